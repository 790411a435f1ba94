# limber_module(NAME SOURCES … [CGAL_SOURCES …] [USES module …] [LINKS target …] [OWNS include-prefix …])
#
# A static library limber_NAME. USES are the modules whose public headers it may include (core always); OWNS are the
# prefixes of third-party headers that only this module's .cpp files may include. CGAL_SOURCES are compiled one at a
# time. The ctest `layering` reads what is said here and every #include in the tree.
function(limber_module NAME)
  cmake_parse_arguments(M "" "" "SOURCES;CGAL_SOURCES;USES;LINKS;OWNS" ${ARGN})
  add_library(limber_${NAME} STATIC ${M_SOURCES})
  if(M_CGAL_SOURCES)
    add_library(limber_${NAME}_cgal OBJECT ${M_CGAL_SOURCES})
    set_target_properties(limber_${NAME}_cgal PROPERTIES JOB_POOL_COMPILE cgal)
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
  set_property(GLOBAL PROPERTY LIMBER_USES_${NAME} "${used}")
  set_property(GLOBAL PROPERTY LIMBER_OWNS_${NAME} "${M_OWNS}")
endfunction()

# limber_tests(NAME SOURCES … USES module …): the executable NAME_tests; one ctest a TEST, labelled NAME. A suite whose name
# ends in _slow stays out of the sanitizer runs.
function(limber_tests NAME)
  cmake_parse_arguments(T "" "" "SOURCES;USES" ${ARGN})
  add_executable(${NAME}_tests ${T_SOURCES})
  foreach(module ${T_USES})
    target_link_libraries(${NAME}_tests PRIVATE limber_${module})
  endforeach()
  target_link_libraries(${NAME}_tests PRIVATE GTest::gtest_main GTest::gmock)
  target_compile_definitions(${NAME}_tests PRIVATE
    LIMBER_SHARED_DATA="${LIMBER_SHARED_DATA}" LIMBER_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    LIMBER_BINARY_DIR="${PROJECT_BINARY_DIR}")
  include(GoogleTest)
  set(environment)
  if(LIMBER_SANITIZE MATCHES address)
    set(environment ENVIRONMENT "LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tools/lsan.supp:print_suppressions=0")
  endif()
  gtest_discover_tests(${NAME}_tests TEST_PREFIX ${NAME}. DISCOVERY_TIMEOUT 60
                       PROPERTIES LABELS ${NAME} TIMEOUT 600 ${environment})
endfunction()

# Writes the module map where the layering test reads it.
function(limber_write_module_map FILE)
  get_property(modules GLOBAL PROPERTY LIMBER_MODULES)
  set(text "set(modules ${modules})\n")
  foreach(module ${modules})
    get_property(uses GLOBAL PROPERTY LIMBER_USES_${module})
    get_property(owns GLOBAL PROPERTY LIMBER_OWNS_${module})
    string(APPEND text "set(uses_${module} ${uses})\nset(owns_${module} ${owns})\n")
  endforeach()
  file(GENERATE OUTPUT ${FILE} CONTENT "${text}")
endfunction()
