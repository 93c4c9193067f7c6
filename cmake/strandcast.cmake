# Build helpers shared by every folder: one place for compiler flags, libraries and tests.

add_library(strandcast_flags INTERFACE)
target_include_directories(strandcast_flags INTERFACE ${CMAKE_SOURCE_DIR})
# -ffp-contract=off: encoder and decoder, and CPU and llvmpipe, must round alike.
target_compile_options(strandcast_flags INTERFACE
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -ffp-contract=off -fno-math-errno -fstack-protector-strong
  $<$<BOOL:${STRANDCAST_WARNINGS_AS_ERRORS}>:-Werror>)
if(CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT STRANDCAST_SANITIZE)
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

# strandcast_library(NAME SOURCES a.cpp ... LIBS x y ...): a static library with the project's flags.
function(strandcast_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC strandcast_flags ${ARG_LIBS})
endfunction()

# strandcast_program(NAME SOURCES ... LIBS ...): an executable in build/<preset>/bin.
function(strandcast_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS})
endfunction()

# strandcast_test(NAME LABEL unit SOURCES ... LIBS ... [SERIAL] [TIMEOUT s]): a GoogleTest program; every
# TEST in it becomes one CTest test. SERIAL: never beside another test (it loads both cores).
function(strandcast_test name)
  cmake_parse_arguments(ARG "SERIAL" "LABEL;TIMEOUT" "SOURCES;LIBS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    STRANDCAST_SHARED_DATA="${CMAKE_SOURCE_DIR}/../shared/data" STRANDCAST_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  if(TARGET strandcast_test_pch)
    target_precompile_headers(${name} REUSE_FROM strandcast_test_pch)
  endif()
  if(STRANDCAST_SANITIZE)
    math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * 5")
  endif()
  set(properties LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
  if(STRANDCAST_SANITIZE MATCHES "thread")
    list(APPEND properties ENVIRONMENT TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/support/tsan.supp)
  endif()
  if(ARG_SERIAL)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 120 PROPERTIES ${properties})
endfunction()
