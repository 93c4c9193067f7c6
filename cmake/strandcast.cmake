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

# Kernels are compiled for several instruction sets (common/simd/variants.h), or for the widest that this machine has.
set(strandcast_has_sets OFF)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT STRANDCAST_SANITIZE)
  set(strandcast_has_sets ON)
  set(strandcast_sets plain avx2 avx512)
  if(STRANDCAST_INSTRUCTION_SETS STREQUAL "native")
    execute_process(COMMAND ${CMAKE_CXX_COMPILER} -march=native -dM -E -x c++ /dev/null OUTPUT_VARIABLE native_macros
      COMMAND_ERROR_IS_FATAL ANY)
    set(only_set 0)
    if(native_macros MATCHES "__AVX512F__" AND native_macros MATCHES "__AVX512VL__"
        AND native_macros MATCHES "__AVX512DQ__" AND native_macros MATCHES "__AVX512BW__")
      set(only_set 2)
    elseif(native_macros MATCHES "__AVX2__")
      set(only_set 1)
    endif()
    list(GET strandcast_sets ${only_set} strandcast_sets)
    target_compile_definitions(strandcast_flags INTERFACE STRANDCAST_ONLY_SET=${only_set})
  elseif(NOT STRANDCAST_INSTRUCTION_SETS STREQUAL "all")
    message(FATAL_ERROR "STRANDCAST_INSTRUCTION_SETS is all or native, not ${STRANDCAST_INSTRUCTION_SETS}")
  endif()
endif()

# lld links in a quarter of the time of ld; it does not read what GCC leaves for optimisation at link time.
find_program(STRANDCAST_LLD ld.lld)
if(STRANDCAST_LLD AND NOT CMAKE_INTERPROCEDURAL_OPTIMIZATION AND NOT EMSCRIPTEN)
  target_link_options(strandcast_flags INTERFACE -fuse-ld=lld)
endif()

# Presets with unity builds (`ci`, `release`) compile sixteen files of a target as one: names in unnamed namespaces are
# distinct within a target, and a test's file has a namespace of its own. What stays single: kernels marked `flatten`
# (common/simd/variants.h), which would take in what else stands in the unit, and files that define macros of others.
if(CMAKE_UNITY_BUILD)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")  # such a unit fills the usual 128 MB again and again: collecting took 7 %
    target_compile_options(strandcast_flags INTERFACE -Wno-subobject-linkage)  # the "header" is a file of the unit
    target_compile_options(strandcast_flags INTERFACE "SHELL:--param ggc-min-expand=200" "SHELL:--param ggc-min-heapsize=524288")
  endif()
endif()
function(strandcast_leave_single)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
function(strandcast_leave_kernels_single)
  foreach(source IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    if(EXISTS ${path})
      file(STRINGS ${path} kernels REGEX "STRANDCAST_KERNEL\\(" LIMIT_COUNT 1)
      if(kernels)
        strandcast_leave_single(${source})
      endif()
    endif()
  endforeach()
endfunction()

# How targets are optimised that do not say COMPUTES. Most files read options, write messages or wait for sockets: there
# -O3 costs half as much again to compile, and saves nothing that shows.
set(strandcast_light_options)
if(CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT STRANDCAST_SANITIZE AND NOT EMSCRIPTEN)
  set(strandcast_light_options -O1)
endif()

# strandcast_library(NAME SOURCES a.cpp ... LIBS x y ... [COMPUTES] [PCH z]): a static library with the project's flags.
# COMPUTES: it walks strands, vertices or pixels, and is optimised as the build type says. PCH: whose precompiled headers
# its files begin with (strandcast_usual where nothing is said; `none`).
function(strandcast_library name)
  cmake_parse_arguments(ARG "COMPUTES" "PCH" "SOURCES;LIBS" ${ARGN})
  if(NOT ARG_PCH)
    set(ARG_PCH strandcast_usual)
  endif()
  strandcast_leave_kernels_single(${ARG_SOURCES})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC strandcast_flags ${ARG_LIBS})
  if(NOT ARG_COMPUTES)
    target_compile_options(${name} PRIVATE ${strandcast_light_options})
  endif()
  if(NOT ARG_PCH STREQUAL "none")
    target_precompile_headers(${name} REUSE_FROM ${ARG_PCH})
  endif()
endfunction()

# strandcast_program(NAME SOURCES ... LIBS ... [COMPUTES] [PCH z]): an executable in build/<preset>/bin, likewise.
function(strandcast_program name)
  cmake_parse_arguments(ARG "COMPUTES" "PCH" "SOURCES;LIBS" ${ARGN})
  if(NOT ARG_PCH)
    set(ARG_PCH strandcast_usual)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS})
  if(NOT ARG_COMPUTES)
    target_compile_options(${name} PRIVATE ${strandcast_light_options})
  endif()
  target_precompile_headers(${name} REUSE_FROM ${ARG_PCH})
endfunction()

# strandcast_test(NAME LABEL unit SOURCES ... LIBS ... [COMPUTES] [ALONE] [OFFLINE] [BUSY suite ...] [PATIENT suite ...] [TIMEOUT s]
# [ENVIRONMENT VARIABLE=value ...]): a GoogleTest program. Every
# suite in it is one CTest test, NAME.Suite; with ALONE every TEST is, NAME.Suite.Test, in a process of its own. Tests of
# the label `integration` run alone and get the label `network` too, which allows a second try (tests/run.sh), unless
# they are OFFLINE; two of them run at once, beside tests that compute (list_tests.cmake). COMPUTES: what its own files compute costs more than to optimise them. BUSY: suites that load both
# cores: one other test runs beside them. PATIENT: suites that wait longest; one of them runs at a time, as a third.
# TIMEOUT: of one CTest test.
function(strandcast_test name)
  cmake_parse_arguments(ARG "COMPUTES;ALONE;OFFLINE" "LABEL;TIMEOUT" "SOURCES;LIBS;BUSY;PATIENT;ENVIRONMENT" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE strandcast_flags ${ARG_LIBS} strandcast_test_main GTest::gmock)
  target_compile_definitions(${name} PRIVATE
    STRANDCAST_SHARED_DATA="${CMAKE_SOURCE_DIR}/../shared/data" STRANDCAST_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  if(ARG_COMPUTES)
    target_compile_options(${name} PRIVATE ${strandcast_light_options})
    target_precompile_headers(${name} REUSE_FROM strandcast_computing_gtest)
  else()
    target_compile_options(${name} PRIVATE ${strandcast_test_options})
    target_precompile_headers(${name} REUSE_FROM strandcast_gtest)
  endif()
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
  set(environment ${ARG_ENVIRONMENT})
  if(STRANDCAST_SANITIZE)
    math(EXPR timeout_s "${timeout_s} * 5")
  endif()
  if(STRANDCAST_SANITIZE MATCHES "thread")
    list(APPEND environment TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/support/tsan.supp)
  endif()
  set(list_file ${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake)
  add_custom_command(TARGET ${name} POST_BUILD BYPRODUCTS ${list_file}
    COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DPROGRAM=$<TARGET_FILE:${name}> -DOUTPUT=${list_file} -DMODE=${mode}
      -DRESULTS=${CMAKE_BINARY_DIR}/test_results -DLISTS=${CMAKE_BINARY_DIR}/test_lists
      "-DLABELS=${labels}" -DTIMEOUT_S=${timeout_s} "-DBUSY=${ARG_BUSY}" "-DPATIENT=${ARG_PATIENT}"
      "-DENVIRONMENT=${environment}" -P ${CMAKE_SOURCE_DIR}/cmake/list_tests.cmake
    VERBATIM)
  # What is not built must not look as if it had passed.
  file(WRITE ${list_file}.include "if(EXISTS \"${list_file}\")\n  include(\"${list_file}\")\nelse()\n"
    "  add_test(${name}_NOT_BUILT ${name}_NOT_BUILT)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${list_file}.include)
endfunction()
