# cmake -DPROGRAM=… -P no_x_test.cmake: fails when the program is linked, directly or not, with a library of a window system. Frames are
# drawn on machines that have none.
execute_process(COMMAND ldd ${PROGRAM} OUTPUT_VARIABLE libraries RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "ldd ${PROGRAM} failed")
endif()
if(NOT libraries MATCHES "libOSMesa|libEGL")
  message(FATAL_ERROR "${PROGRAM} is not linked with any OpenGL; was another program meant?\n${libraries}")
endif()
if(libraries MATCHES "(lib(X[a-zA-Z0-9]*|xcb[-a-z0-9]*|wayland[-a-z]*|GL|GLX|GLU|glut|glfw))\\.so")
  message(FATAL_ERROR "${PROGRAM} is linked with ${CMAKE_MATCH_1}, which a machine without a display lacks")
endif()
