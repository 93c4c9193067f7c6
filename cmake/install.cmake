# What `cmake --install` puts where, in components: server, viewer, tools, doc, dev. cmake/packages.cmake makes Debian
# packages of the same.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(packages ${CMAKE_SOURCE_DIR}/deploy/packages)
set(made ${CMAKE_BINARY_DIR}/installed_files)

install(TARGETS strandcast-server COMPONENT server)
install(TARGETS strandcast-view COMPONENT viewer)
install(TARGETS strandcast-ctl strandcast-report strandcast-load COMPONENT tools)
install(DIRECTORY deploy/scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/strandcast COMPONENT server)
install(DIRECTORY deploy/scenarios DESTINATION ${CMAKE_INSTALL_DATADIR}/strandcast COMPONENT tools)
install(DIRECTORY server/report/truth DESTINATION ${CMAKE_INSTALL_DATADIR}/strandcast COMPONENT tools)

# strandcast-ctl fleet and grid start them.
install(PROGRAMS deploy/fleet/strandcast-fleet deploy/fleet/strandcast-grid DESTINATION lib/strandcast COMPONENT tools)

install(FILES deploy/strandcast-server.service deploy/strandcast-server.socket DESTINATION lib/systemd/system
  COMPONENT server)

install(FILES ${packages}/strandcast-view.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT viewer)
install(FILES ${packages}/strandcast.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages COMPONENT viewer)
install(FILES ${packages}/strandcast.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps
  COMPONENT viewer)

# ---- documents

set(documents ${CMAKE_INSTALL_DATADIR}/doc/strandcast-doc)
install(FILES README.md ARCHITECTURE.md CONTRIBUTING.md STYLE.md SECURITY.md CHANGELOG.md DESTINATION ${documents}
  COMPONENT doc)
install(DIRECTORY docs DESTINATION ${documents} COMPONENT doc)
install(FILES shaders/README.md DESTINATION ${documents}/shaders COMPONENT doc)
install(FILES proto/WIRE.md proto/RECORDING.md DESTINATION ${documents}/proto COMPONENT doc)
install(DIRECTORY proto/strandcast DESTINATION ${documents}/proto COMPONENT doc)
install(FILES deploy/eight_seconds.png deploy/hair.png deploy/page.png deploy/streaming.png deploy/work_precision.png
  DESTINATION ${documents}/deploy COMPONENT doc)
install(DIRECTORY examples DESTINATION ${documents} COMPONENT doc)
install(DIRECTORY tests/conformance/vectors DESTINATION ${documents}/conformance COMPONENT doc)

# Of each program what it says of itself (--help) as a manual page, and what a shell completes.
find_program(GZIP gzip REQUIRED)
file(GLOB help_scripts CONFIGURE_DEPENDS ${packages}/from_help.sh ${packages}/*.awk)
set(component_server server)
set(component_view viewer)
set(component_ctl tools)
set(component_report tools)
set(component_load tools)
foreach(name server view ctl report load)
  set(program strandcast-${name})
  add_custom_command(OUTPUT ${made}/${program}.1.gz ${made}/completions/${program}
    COMMAND bash ${packages}/from_help.sh $<TARGET_FILE:${program}> ${made} ${PROJECT_VERSION}
    DEPENDS ${program} ${help_scripts} VERBATIM)
  list(APPEND help_files ${made}/${program}.1.gz ${made}/completions/${program})
  install(FILES ${made}/${program}.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${component_${name}})
  install(FILES ${made}/completions/${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    COMPONENT ${component_${name}})
endforeach()
add_custom_target(strandcast_help_files ALL DEPENDS ${help_files})

# ---- the strand core, for other programs: find_package(Strandcast) gives Strandcast::core

# One archive of the folders' own.
get_property(lane_sets GLOBAL PROPERTY strandcast_lane_sets)
list(TRANSFORM lane_sets PREPEND lanes_)
set(core_parts base simd math ${lane_sets} lane_kernels kernels strands replay)
list(TRANSFORM core_parts REPLACE "(.+)" "$<TARGET_OBJECTS:strandcast_\\1>" OUTPUT_VARIABLE core_objects)
add_library(strandcast_core STATIC ${core_objects})
set_target_properties(strandcast_core PROPERTIES EXPORT_NAME core LINKER_LANGUAGE CXX)
target_compile_features(strandcast_core INTERFACE cxx_std_20)
target_compile_options(strandcast_core INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>)  # lanes are always inlined
target_include_directories(strandcast_core INTERFACE
  $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/strandcast>)
target_link_libraries(strandcast_core INTERFACE fmt::fmt Threads::Threads
  $<BUILD_INTERFACE:PkgConfig::ZSTD> $<INSTALL_INTERFACE:PkgConfig::STRANDCAST_ZSTD>)
add_library(Strandcast::core ALIAS strandcast_core)

# What a program needs that decodes a stream, and what these headers include.
set(core_headers
  base/frame_rate.h base/profile.h base/result.h base/timecode.h base/version.h base/worker_pool.h
  math/bust.h math/pose.h math/strand_guides.h
  replay/clock_offset.h replay/interpolation.h replay/playout_clock.h replay/position_blend.h
  replay/state_blend.h replay/strand_fill.h replay/strand_replay.h
  simd/lane_vectors_private.h simd/lanes.h simd/variants.h
  strands/frame_header.h strands/posed_strands.h strands/scene_asset.h strands/snapshot.h strands/strand_codec.h
  strands/strand_limits.h strands/strand_prefix.h)
foreach(header IN LISTS core_headers)
  cmake_path(GET header PARENT_PATH folder)
  install(FILES common/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/strandcast/common/${folder} COMPONENT dev)
endforeach()
install(DIRECTORY proto/strandcast DESTINATION ${CMAKE_INSTALL_DATADIR}/strandcast/proto COMPONENT dev
  FILES_MATCHING PATTERN *.proto)

set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Strandcast)
install(TARGETS strandcast_core EXPORT StrandcastTargets COMPONENT dev)
install(EXPORT StrandcastTargets NAMESPACE Strandcast:: DESTINATION ${config_folder} COMPONENT dev)
configure_package_config_file(cmake/StrandcastConfig.cmake.in ${made}/StrandcastConfig.cmake
  INSTALL_DESTINATION ${config_folder} PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${made}/StrandcastConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${made}/StrandcastConfig.cmake ${made}/StrandcastConfigVersion.cmake DESTINATION ${config_folder}
  COMPONENT dev)
