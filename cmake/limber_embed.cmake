# limber_embed(OUTPUT NAMESPACE NAME=FILE …): writes OUTPUT, a .cpp that holds each file as `extern const char* const NAME`.
function(limber_embed OUTPUT NAMESPACE)
  set(text "namespace ${NAMESPACE} {\n")
  foreach(pair ${ARGN})
    string(REGEX MATCH "^([^=]+)=(.+)$" matched "${pair}")
    file(READ "${CMAKE_CURRENT_SOURCE_DIR}/${CMAKE_MATCH_2}" content)
    string(APPEND text "extern const char* const ${CMAKE_MATCH_1};\n"
                       "const char* const ${CMAKE_MATCH_1} = R\"embedded(${content})embedded\";\n")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${CMAKE_MATCH_2}")
  endforeach()
  file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT "${text}}\n" @ONLY)
endfunction()
