# The page for browsers, in a build of its own with another compiler (preset web): strandcast_web makes it, and what
# the tests of WebAssembly run.
find_program(EMSCRIPTEN_COMPILER em++)
find_program(ESBUILD esbuild)
if(NOT EMSCRIPTEN_COMPILER OR NOT ESBUILD)
  message(FATAL_ERROR "STRANDCAST_WEB needs emscripten and esbuild: bash deploy/install_deps.sh emscripten esbuild dpkg-dev")
endif()
set(strandcast_page_files ${CMAKE_BINARY_DIR}/web/page/page_files.cpp)
set(web_targets --target strandcast_page_files strandcast_package)
if(BUILD_TESTING)
  set(web_targets "")
endif()
add_custom_target(strandcast_web ALL
  COMMAND ${CMAKE_COMMAND} --preset web -B ${CMAKE_BINARY_DIR}/web
  COMMAND ${CMAKE_COMMAND} --build ${CMAKE_BINARY_DIR}/web ${web_targets}
  BYPRODUCTS ${strandcast_page_files}
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR} USES_TERMINAL VERBATIM)
