# The strand core for browsers, with emscripten's compiler: its libraries from common/, what they need besides, and
# client/web. glm is headers, of fmt client/web/fmt stands in; of zstd the decoder is compiled from Debian's source, which
# client/web/fetch_zstd.sh leaves in the build folder.

enable_language(C)
# em++ and emar take a second to call what does the work, for each file: here that is called as they would.
foreach(variable LLVM_ROOT CLANG_ADD_VERSION)
  execute_process(COMMAND em-config ${variable} OUTPUT_VARIABLE ${variable} OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
endforeach()
set(CMAKE_AR ${LLVM_ROOT}/llvm-ar-${CLANG_ADD_VERSION})
set(CMAKE_RANLIB ${LLVM_ROOT}/llvm-ranlib-${CLANG_ADD_VERSION})
set(clang_C ${LLVM_ROOT}/clang-${CLANG_ADD_VERSION})
set(clang_CXX ${LLVM_ROOT}/clang++-${CLANG_ADD_VERSION})
foreach(language C CXX)
  execute_process(COMMAND ${CMAKE_${language}_COMPILER} --cflags OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "<CMAKE_${language}_COMPILER>" "${clang_${language}} ${flags}" CMAKE_${language}_COMPILE_OBJECT
    "${CMAKE_${language}_COMPILE_OBJECT}")
endforeach()
# Whatever has SIMD fills and copies memory by an instruction too.
add_compile_options(-msimd128 -mbulk-memory -fmacro-prefix-map=${CMAKE_SOURCE_DIR}/= $<$<COMPILE_LANGUAGE:CXX>:-fno-rtti> -Wno-defaulted-function-deleted)  # its standard library compares less

set(headers ${CMAKE_BINARY_DIR}/headers)  # not all of /usr/include: its C library is another one
file(MAKE_DIRECTORY ${headers})
file(CREATE_LINK /usr/include/glm ${headers}/glm SYMBOLIC)
file(CREATE_LINK ${CMAKE_SOURCE_DIR}/client/web/fmt ${headers}/fmt SYMBOLIC)
target_include_directories(strandcast_flags SYSTEM INTERFACE ${headers})

add_library(fmt STATIC client/web/fmt/format.cpp)
target_link_libraries(fmt PRIVATE strandcast_flags)
target_link_options(fmt INTERFACE --js-library ${CMAKE_SOURCE_DIR}/client/web/fmt/imports.js)
add_library(fmt::fmt ALIAS fmt)
add_library(threads INTERFACE)  # there are none
add_library(Threads::Threads ALIAS threads)

set(zstd_source ${CMAKE_BINARY_DIR}/zstd)
execute_process(COMMAND bash ${CMAKE_SOURCE_DIR}/client/web/fetch_zstd.sh ${zstd_source} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB zstd_files ${zstd_source}/lib/common/*.c ${zstd_source}/lib/decompress/*.c)
add_library(zstd STATIC ${zstd_files})
target_compile_options(zstd PRIVATE -Os)
target_compile_definitions(zstd PRIVATE ZSTD_DISABLE_ASM HUF_FORCE_DECOMPRESS_X1 ZSTD_FORCE_DECOMPRESS_SEQUENCES_SHORT
  ZSTD_NO_INLINE)  # small: it decodes 10 kB once
target_include_directories(zstd SYSTEM INTERFACE ${zstd_source}/lib)
add_library(PkgConfig::ZSTD ALIAS zstd)

# Files for size begin with the headers of the others: what is parsed is the same.
add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:SHELL:-Xclang -fno-validate-pch>")
include(cmake/precompiled.cmake)
foreach(folder base simd math kernels strands)
  add_subdirectory(common/${folder})
endforeach()
# Of what draws, the parts without OpenGL.
add_library(strandcast_picture STATIC common/groom/bust_skin.cpp common/groom/mesh.cpp common/math/point_tree.cpp common/replay/strand_fill.cpp common/scene/hair_color.cpp common/scene/scene_desc.cpp)
foreach(part head_occupancy light_lattice look_lights rest_facts scalp_cover strand_detail strand_style view
             gl_tiles/tile_block tiles/strand_expansion tiles/strand_shading tiles/strand_sums tiles/tile_bins tiles/tile_raster)
  target_sources(strandcast_picture PRIVATE common/render/${part}.cpp)
endforeach()
target_include_directories(strandcast_picture PRIVATE ${CMAKE_SOURCE_DIR}/shaders)  # the laws of shaders/lib
target_link_libraries(strandcast_picture PUBLIC strandcast_strands strandcast_simd)
target_precompile_headers(strandcast_picture REUSE_FROM strandcast_usual)

# Small before quick, where no time of a state goes.
function(strandcast_small folder)
  list(TRANSFORM ARGN PREPEND ${CMAKE_SOURCE_DIR}/${folder}/)
  set_source_files_properties(${ARGN} DIRECTORY ${folder} PROPERTIES COMPILE_OPTIONS -Os)
endfunction()
strandcast_small(common/base base.cpp text.cpp worker_pool.cpp)
strandcast_small(common/kernels head_path.cpp lane_program.cpp step_input.cpp step_model.cpp step_speed.cpp
  strand_passes.cpp told_field.cpp)
strandcast_small(common/strands delta_codec.cpp frame_header.cpp raw_codec.cpp scene_asset.cpp strand_codec.cpp
  strand_payload.cpp strand_prefix.cpp zstd_block.cpp tangent/codec.cpp tangent/fit.cpp tangent/fit_shape.cpp tangent/head.cpp
  tangent/layout.cpp tangent/order.cpp asset/form.cpp asset/head.cpp asset/lattice.cpp asset/strands.cpp asset/triangles.cpp
  head/head_form.cpp head/head_mesh.cpp step/predictor_state.cpp step/rod_planes.cpp step/steps.cpp step/wire.cpp)
strandcast_small(. common/groom/mesh.cpp common/scene/hair_color.cpp common/scene/scene_desc.cpp common/render/head_occupancy.cpp common/render/look_lights.cpp
  common/render/rest_facts.cpp common/render/scalp_cover.cpp common/render/strand_detail.cpp common/render/strand_style.cpp
  common/render/view.cpp common/render/gl_tiles/tile_block.cpp client/web/fmt/format.cpp)
add_subdirectory(client/web)
strandcast_small(client/web core_export.cpp tangent_only.cpp)
add_subdirectory(tests/web)
