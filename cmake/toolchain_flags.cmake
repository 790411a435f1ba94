# Flags that every target shares. Same input, same bytes: no contraction of a*b+c into one rounding, no fast-math.
add_compile_options(-ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Werror)
# Eigen's inlined loads trip GCC 12's false positives; GCC bugs 105562 and 106199 are of this family.
add_compile_options(-Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
if(LIMBER_UNITY)
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
  # A name of one file is not hidden by a local one of another in its batch; a file in a batch is no header, and its
  # unnamed namespace its own; and inlined concatenations of strings trip GCC 12's false positives (bug 105651).
  add_compile_options(-Wno-shadow -Wno-subobject-linkage -Wno-restrict)
endif()
if(LIMBER_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link -Wno-error -Wno-unknown-warning-option)
endif()
# Python and other programs load what we build; none of its functions is to be replaced from outside, so they may be inlined.
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
add_compile_options(-fno-semantic-interposition)
include_directories(${PROJECT_SOURCE_DIR})
# A file's name in a message is the same wherever the clone lies; so are the objects, which a compiler cache may then share.
add_compile_options(-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=)
if(LIMBER_SANITIZE)
  add_compile_options(-fsanitize=${LIMBER_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(LIMBER_SANITIZE MATCHES "undefined")
    # A bad access is AddressSanitizer's to see; to check each address before it, too, is a third of all compiling.
    add_compile_options(-fno-sanitize=null,alignment,object-size,vptr)
  endif()
  add_link_options(-fsanitize=${LIMBER_SANITIZE})
endif()

# A file that includes CGAL takes up to 3 GB and 98 s to compile: one at a time.
set_property(GLOBAL PROPERTY JOB_POOLS cgal=1)
