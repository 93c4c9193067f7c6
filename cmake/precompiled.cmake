# Headers that nearly every file includes, parsed once per kind of target. A file still includes what it uses: the
# presets fuzz and lto build without precompiled headers, and find what is missing.
set(strandcast_usual_headers <algorithm> <array> <atomic> <bit> <charconv> <chrono> <cmath> <condition_variable>
  <cstddef> <cstdint> <cstring> <deque> <filesystem> <functional> <limits> <map> <memory> <mutex> <numbers> <numeric>
  <optional> <set> <span> <string> <string_view> <thread> <utility> <variant> <vector>
  <fmt/format.h> <glm/glm.hpp> <glm/gtc/quaternion.hpp>)
if(NOT EMSCRIPTEN)  # client/web/fmt has none
  list(APPEND strandcast_usual_headers <fmt/ranges.h>)
endif()

# strandcast_precompile(NAME HEADERS <a> ... LIBS x ... [OPTIONS -O1]): a library that only carries precompiled headers.
function(strandcast_precompile name)
  cmake_parse_arguments(ARG "" "" "HEADERS;LIBS;OPTIONS" ${ARGN})
  add_library(${name} STATIC ${CMAKE_SOURCE_DIR}/cmake/precompiled.cpp)
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS})
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

strandcast_precompile(strandcast_usual HEADERS ${strandcast_usual_headers} LIBS fmt::fmt)
# Command lines: CLI11 is templates in headers, and takes longer to compile than what it reads takes to run.
if(NOT EMSCRIPTEN)
  strandcast_precompile(strandcast_command_line HEADERS ${strandcast_usual_headers} <CLI/CLI.hpp> LIBS fmt::fmt OPTIONS -O1)
endif()
