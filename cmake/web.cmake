# The strand core for browsers, with emscripten's compiler: its libraries from common/, what they need besides, and
# client/web. fmt and glm are headers; of zstd the decoder is compiled from Debian's source, which client/web/fetch_zstd.sh
# leaves in the build folder.
add_compile_options(-msimd128 $<$<COMPILE_LANGUAGE:CXX>:-fno-rtti> -Wno-defaulted-function-deleted)  # its standard library compares less

set(headers ${CMAKE_BINARY_DIR}/headers)  # not all of /usr/include: its C library is another one
file(MAKE_DIRECTORY ${headers})
foreach(folder fmt glm)
  file(CREATE_LINK /usr/include/${folder} ${headers}/${folder} SYMBOLIC)
endforeach()
target_include_directories(strandcast_flags SYSTEM INTERFACE ${headers})

add_library(fmt INTERFACE)
target_compile_definitions(fmt INTERFACE FMT_HEADER_ONLY FMT_STATIC_THOUSANDS_SEPARATOR=',' FMT_USE_LONG_DOUBLE=0)  # no locales
add_library(fmt::fmt ALIAS fmt)
add_library(threads INTERFACE)  # there are none
add_library(Threads::Threads ALIAS threads)

set(zstd_source ${CMAKE_BINARY_DIR}/zstd)
if(NOT EXISTS ${zstd_source}/lib/zstd.h)
  execute_process(COMMAND bash ${CMAKE_SOURCE_DIR}/client/web/fetch_zstd.sh ${zstd_source} COMMAND_ERROR_IS_FATAL ANY)
endif()
enable_language(C)
file(GLOB zstd_files ${zstd_source}/lib/common/*.c ${zstd_source}/lib/decompress/*.c)
add_library(zstd STATIC ${zstd_files})
target_compile_definitions(zstd PRIVATE ZSTD_DISABLE_ASM HUF_FORCE_DECOMPRESS_X1 ZSTD_FORCE_DECOMPRESS_SEQUENCES_SHORT
  ZSTD_NO_INLINE)  # small: it decodes 10 kB once
target_include_directories(zstd SYSTEM INTERFACE ${zstd_source}/lib)
add_library(PkgConfig::ZSTD ALIAS zstd)

include(cmake/precompiled.cmake)
foreach(folder base simd math kernels strands)
  add_subdirectory(common/${folder})
endforeach()
# Of what draws, the parts without OpenGL.
add_library(strandcast_picture STATIC common/groom/mesh.cpp common/replay/strand_fill.cpp common/scene/hair_color.cpp)
foreach(part head_occupancy light_lattice look_lights rest_facts scalp_cover strand_detail strand_style view
             gl_tiles/tile_block tiles/strand_expansion tiles/strand_shading tiles/tile_bins tiles/tile_raster)
  target_sources(strandcast_picture PRIVATE common/render/${part}.cpp)
endforeach()
target_include_directories(strandcast_picture PRIVATE ${CMAKE_SOURCE_DIR}/shaders)  # the laws of shaders/lib
target_link_libraries(strandcast_picture PUBLIC strandcast_strands strandcast_simd)
add_subdirectory(client/web)
add_subdirectory(tests/web)
