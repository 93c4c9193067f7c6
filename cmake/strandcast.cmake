# Build helpers shared by every folder: one place for compiler flags, libraries and tests.

add_library(strandcast_flags INTERFACE)
target_include_directories(strandcast_flags INTERFACE ${CMAKE_SOURCE_DIR})
# -ffp-contract=off: encoder and decoder, and CPU and llvmpipe, must round alike.
target_compile_options(strandcast_flags INTERFACE
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -ffp-contract=off -fno-math-errno
  $<$<NOT:$<BOOL:${EMSCRIPTEN}>>:-fstack-protector-strong>
  $<$<BOOL:${STRANDCAST_WARNINGS_AS_ERRORS}>:-Werror>)
if(CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT STRANDCAST_SANITIZE AND NOT EMSCRIPTEN)
  target_compile_definitions(strandcast_flags INTERFACE _FORTIFY_SOURCE=2)
  # Checked by tests/tools/check_hardening.sh.
  target_link_options(strandcast_flags INTERFACE -pie -Wl,-z,relro,-z,now,-z,noexecstack)
endif()
if(STRANDCAST_SANITIZE)
  set(strandcast_sanitize_options -fsanitize=${STRANDCAST_SANITIZE})
  if(STRANDCAST_SANITIZE MATCHES "thread")
    # Under this macro protobuf's headers give map fields another layout than the installed library has. Only
    # libstdc++ reads it besides, and has a macro of its own.
    list(APPEND strandcast_sanitize_options -U__SANITIZE_THREAD__ -D_GLIBCXX_TSAN=1)
  endif()
  # GCC sees uninitialised values in instrumented library templates that are none.
  target_compile_options(strandcast_flags INTERFACE ${strandcast_sanitize_options} -fno-sanitize-recover=all
    -fno-omit-frame-pointer $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_compile_definitions(strandcast_flags INTERFACE _GLIBCXX_ASSERTIONS)
  target_link_options(strandcast_flags INTERFACE -fsanitize=${STRANDCAST_SANITIZE})
endif()

# strandcast_library(NAME SOURCES a.cpp ... LIBS x y ... [PCH z]): a static library with the project's flags. PCH: whose
# precompiled headers its files begin with (strandcast_usual where nothing is said; `none`).
function(strandcast_library name)
  cmake_parse_arguments(ARG "" "PCH" "SOURCES;LIBS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC strandcast_flags ${ARG_LIBS})
  if(NOT ARG_PCH)
    set(ARG_PCH strandcast_usual)
  endif()
  if(NOT ARG_PCH STREQUAL "none")
    target_precompile_headers(${name} REUSE_FROM ${ARG_PCH})
  endif()
endfunction()

# strandcast_program(NAME SOURCES ... LIBS ...): an executable in build/<preset>/bin.
function(strandcast_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS})
  target_precompile_headers(${name} REUSE_FROM strandcast_usual)
endfunction()

# strandcast_lightly_optimised(a.cpp ...): files of this folder that read options or drive tests, where -O3 costs more
# to compile than it ever saves.
function(strandcast_lightly_optimised)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -O1)
endfunction()

# strandcast_test(NAME LABEL unit SOURCES ... LIBS ... [ALONE] [OFFLINE] [SERIAL] [TIMEOUT s]): a GoogleTest program. Every
# suite in it is one CTest test, NAME.Suite; with ALONE every TEST is, NAME.Suite.Test, in a process of its own. Tests of
# the label `integration` run alone and get the label `network` too, which allows a second try (tests/run.sh), unless
# they are OFFLINE. SERIAL: never beside another test (it loads both cores). TIMEOUT: of one CTest test.
function(strandcast_test name)
  cmake_parse_arguments(ARG "ALONE;OFFLINE;SERIAL" "LABEL;TIMEOUT" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    STRANDCAST_SHARED_DATA="${CMAKE_SOURCE_DIR}/../shared/data" STRANDCAST_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_compile_options(${name} PRIVATE ${strandcast_test_options})
  target_precompile_headers(${name} REUSE_FROM strandcast_gtest)
  set(mode suites)
  set(timeout_s 600)
  set(labels ${ARG_LABEL})
  if(ARG_LABEL STREQUAL "integration" AND NOT ARG_OFFLINE)
    list(APPEND labels network)
  endif()
  if(ARG_LABEL STREQUAL "integration" OR ARG_ALONE)
    set(mode tests)
    set(timeout_s 120)
  endif()
  if(ARG_TIMEOUT)
    set(timeout_s ${ARG_TIMEOUT})
  endif()
  set(environment "")
  if(STRANDCAST_SANITIZE)
    math(EXPR timeout_s "${timeout_s} * 5")
  endif()
  if(STRANDCAST_SANITIZE MATCHES "thread")
    set(environment TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/support/tsan.supp)
  endif()
  set(list_file ${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake)
  add_custom_command(TARGET ${name} POST_BUILD BYPRODUCTS ${list_file}
    COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DPROGRAM=$<TARGET_FILE:${name}> -DOUTPUT=${list_file} -DMODE=${mode}
      -DRESULTS=${CMAKE_BINARY_DIR}/test_results -DLISTS=${CMAKE_BINARY_DIR}/test_lists
      "-DLABELS=${labels}" -DTIMEOUT_S=${timeout_s} -DSERIAL=${ARG_SERIAL}
      -DENVIRONMENT=${environment} -P ${CMAKE_SOURCE_DIR}/cmake/list_tests.cmake
    VERBATIM)
  # What is not built must not look as if it had passed.
  file(WRITE ${list_file}.include "if(EXISTS \"${list_file}\")\n  include(\"${list_file}\")\nelse()\n"
    "  add_test(${name}_NOT_BUILT ${name}_NOT_BUILT)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${list_file}.include)
endfunction()
