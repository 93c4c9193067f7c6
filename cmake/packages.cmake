# Debian packages of what cmake/install.cmake installs: `cpack -G DEB` in the build folder leaves them in packages/.
# Their dependencies are those that dpkg-shlibdeps finds, and what programs load by themselves.
set(STRANDCAST_PACKAGE_CONTACT "Strandcast <packages@strandcast.invalid>" CACHE STRING
  "Name and address of whoever makes packages of this build")
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME strandcast)
set(CPACK_PACKAGE_CONTACT "${STRANDCAST_PACKAGE_CONTACT}")
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL server viewer tools doc dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

# strandcast_package(COMPONENT NAME SUMMARY TEXT): lines of at most 79 characters.
function(strandcast_package component name summary text)
  string(TOUPPER ${component} key)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_COMPONENT_${key}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
  # What every Debian package has to say of itself.
  install(FILES ${packages}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component})
  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH where it is set
  file(CONFIGURE OUTPUT ${made}/${name}/changelog CONTENT
"${name} (${PROJECT_VERSION}) unstable; urgency=medium

  * As CHANGELOG.md in strandcast-doc says.

 -- ${STRANDCAST_PACKAGE_CONTACT}  ${date}
")
  execute_process(COMMAND ${GZIP} -9nf ${made}/${name}/changelog COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${made}/${name}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component})
endfunction()

strandcast_package(server strandcast-server "hair simulation server"
"Simulates hair strands on a GPU, or on the processors where there is none,
and streams them or pictures of them to viewers over one TCP port.
The service is installed and not started:
systemctl enable --now strandcast-server")
strandcast_package(viewer strandcast-viewer "viewer of simulated hair"
"Shows the hair that a Strandcast server simulates, drawn from strands or as
pictures, and plays recordings of it. It needs no strong machine.")
strandcast_package(tools strandcast-tools "tools for a hair simulation server"
"strandcast-ctl feeds, steers, watches and tests a Strandcast server;
strandcast-report compares strand models, codecs and ways to draw;
strandcast-load is many viewers at once.")
strandcast_package(doc strandcast-doc "documents and examples of a hair simulation server"
"How Strandcast is used and built, its protocol and file formats byte by byte,
clients in C++, Python and JavaScript as examples, and kept streams to test
others with.")
strandcast_package(dev libstrandcast-dev "strand core of Strandcast, for other programs"
"Decodes strands that a Strandcast server streams: codecs, replay and the
protocol's messages. For CMake: find_package(Strandcast).")

set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOC_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libfmt-dev, libglm-dev, libzstd-dev, pkg-config")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "libboost-dev, libprotobuf-dev, protobuf-compiler, strandcast-doc")
# OpenGL is looked for at run time: without the first two libepoxy would end the program, without the third there is none.
foreach(key SERVER VIEWER TOOLS)
  set(CPACK_DEBIAN_${key}_PACKAGE_DEPENDS "libegl1, libopengl0")
  set(CPACK_DEBIAN_${key}_PACKAGE_RECOMMENDS libgl1-mesa-dri)
endforeach()
string(APPEND CPACK_DEBIAN_SERVER_PACKAGE_RECOMMENDS ", strandcast-tools")
string(APPEND CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS ", python3, strandcast-server")
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA ${packages}/postinst ${packages}/prerm ${packages}/postrm)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
