# limber_module(NAME [COLD] SOURCES … [CGAL_SOURCES …] [USES module …] [OPENS module …] [OF_CORE header …] [ROOMS folder …]
#               [LINKS target …] [OWNS include-prefix …])
#
# A static library limber_NAME. USES are the modules whose public headers it may include (core always), OPENS those
# whose detail/ it may include, too; OF_CORE, where it is given, all headers of core that it may include. ROOMS are the
# folders of its detail/, each of which may include those before it. OWNS are the prefixes of third-party headers that
# only this module's .cpp files may include. CGAL_SOURCES are compiled one at a time. COLD: no loop that users wait for, so
# a release compiles it with -O2, a tenth quicker. The ctest `layering` reads what is said here and every #include in the tree.
function(limber_module NAME)
  cmake_parse_arguments(M "COLD" "" "SOURCES;CGAL_SOURCES;USES;OPENS;OF_CORE;ROOMS;LINKS;OWNS" ${ARGN})
  add_library(limber_${NAME} STATIC ${M_SOURCES})
  if(M_COLD)
    target_compile_options(limber_${NAME} PRIVATE $<$<CONFIG:Release>:-O2>)
  endif()
  if(M_CGAL_SOURCES)
    add_library(limber_${NAME}_cgal OBJECT ${M_CGAL_SOURCES})
    set_target_properties(limber_${NAME}_cgal PROPERTIES JOB_POOL_COMPILE cgal UNITY_BUILD OFF)
    target_link_libraries(limber_${NAME}_cgal PRIVATE limber_core CGAL::CGAL ${M_LINKS})
    target_sources(limber_${NAME} PRIVATE $<TARGET_OBJECTS:limber_${NAME}_cgal>)
    target_link_libraries(limber_${NAME} PRIVATE CGAL::CGAL)
  endif()
  set(used ${M_USES})
  if(NOT NAME STREQUAL core)
    list(APPEND used core)
  endif()
  list(REMOVE_DUPLICATES used)
  foreach(module ${used})
    target_link_libraries(limber_${NAME} PUBLIC limber_${module})
  endforeach()
  target_link_libraries(limber_${NAME} PUBLIC ${M_LINKS})
  set_property(GLOBAL APPEND PROPERTY LIMBER_MODULES ${NAME})
  set(uses "${used}")
  set(opens "${M_OPENS}")
  set(of_core "${M_OF_CORE}")
  set(rooms "${M_ROOMS}")
  set(owns "${M_OWNS}")
  foreach(what uses opens of_core rooms owns)
    set_property(GLOBAL APPEND_STRING PROPERTY LIMBER_MAP "set(${what}_${NAME} ${${what}})\n")
  endforeach()
endfunction()

# limber_tests(NAME [LONG] [WHOLE] SOURCES … USES module …): the executable NAME_tests; one ctest a TEST, labelled NAME, or NAME_slow
# where the TEST's suite ends in _slow. What is labelled _slow stays out of the sanitizer runs, and is
# not built for them either where the whole executable is slow. The slow ones of what is LONG are labelled NAME_slow_long:
# tools/test leaves them to `tools/test long`. WHOLE: of whole commands, minutes under sanitizers, so the quick
# ones are labelled _slow, too.
function(limber_tests NAME)
  cmake_parse_arguments(T "LONG;WHOLE" "" "SOURCES;USES" ${ARGN})
  add_executable(${NAME}_tests ${T_SOURCES})
  foreach(module ${T_USES})
    target_link_libraries(${NAME}_tests PRIVATE limber_${module})
  endforeach()
  target_link_libraries(${NAME}_tests PRIVATE limber_places GTest::gtest_main GTest::gmock)
  if(LIMBER_SANITIZE AND (T_WHOLE OR NAME MATCHES "_slow$"))
    set_target_properties(${NAME}_tests PROPERTIES EXCLUDE_FROM_ALL ON)
    return()
  endif()
  include(GoogleTest)
  set(environment)
  if(LIMBER_SANITIZE MATCHES address)
    set(environment ENVIRONMENT "LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tools/lsan.supp:print_suppressions=0")
  endif()
  foreach(part "-*_slow.*|${NAME}" "*_slow.*|${NAME}_slow")
    string(REGEX MATCH "^(.*)[|](.*)$" part "${part}")
    set(filter "${CMAKE_MATCH_1}")
    set(label "${CMAKE_MATCH_2}")
    set(timeout_s 600)
    if(T_LONG AND label MATCHES "_slow$")
      string(APPEND label "_long")
      set(timeout_s 1800)
    elseif(T_WHOLE AND NOT label MATCHES "_slow$")
      string(APPEND label "_slow")
    endif()
    gtest_discover_tests(${NAME}_tests TEST_PREFIX ${NAME}. TEST_FILTER "${filter}" DISCOVERY_TIMEOUT 60
                         PROPERTIES LABELS ${label} TIMEOUT ${timeout_s} ${environment})
  endforeach()
endfunction()

# Writes the module map where the layering test reads it.
function(limber_write_module_map FILE)
  get_property(modules GLOBAL PROPERTY LIMBER_MODULES)
  get_property(map GLOBAL PROPERTY LIMBER_MAP)
  file(GENERATE OUTPUT ${FILE} CONTENT "set(modules ${modules})\n${map}")
endfunction()
