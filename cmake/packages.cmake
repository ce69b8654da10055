# cpack --config DIR/CPackConfig.cmake builds Debian packages, one for each component of the installation.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL programs development documents)
if(YOUBOT_PYTHON_PACKAGE)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
                                                WORLD_EXECUTE)
set(CMAKE_SKIP_PACKAGE_ALL_DEPENDENCY ON)  # no package contains tests or benchmarks

set(CPACK_PACKAGE_VENDOR "the youbot-hal authors")
set(CPACK_PACKAGE_CONTACT "The youbot-hal authors <youbot-hal@example.invalid>")  # no address is published
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "KUKA youBot: real-time drivers, control and haptic teleoperation")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME youbot-hal)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS youbot-hal-doc)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/postinst
    ${PROJECT_SOURCE_DIR}/cmake/debian/prerm ${PROJECT_SOURCE_DIR}/cmake/debian/postrm)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION "A 1 kHz daemon for base, arm and haptic devices, tools that measure and \
identify friction, a simulated robot on a network interface, udev rules and a systemd service, which stays off until \
it is enabled.")

# The dependencies in youbot-config.cmake and youbot.pc; identification also needs Ceres.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libyoubot-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4), libhidapi-dev, liblz4-dev, liborocos-kdl-dev, \
libsodium-dev, libspdlog-dev, liburdfdom-dev, libusb-1.0-0-dev, libzstd-dev, pkgconf | pkg-config")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS libceres-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS youbot-hal-doc)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Static libraries, headers and examples for programs of your own, which \
find_package(youbot) and pkg-config find.")

set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_NAME youbot-hal-doc)
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_DOCUMENTS_DESCRIPTION "Documents in Markdown: set-up of a robot, programs, file formats, safety, \
bounds and architecture.")

# The module works with one minor version of Python only.
if(YOUBOT_PYTHON_PACKAGE)
  math(EXPR next_python "${YOUBOT_PYTHON_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-youbot)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${YOUBOT_PYTHON_MINOR}), python3 (<< 3.${next_python}), \
python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS youbot-hal-doc)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Robots, friction models, recordings and the search for missing effects in \
Python, with numpy.")
endif()

# Each Debian package contains its licence, and those of dygraphs and three.js, which the programs embed.
file(READ NOTICE notice)
file(READ ${YOUBOT_DYGRAPHS_LICENSE} dygraphs)
file(READ ${YOUBOT_THREE_LICENSE} three)
file(WRITE ${PROJECT_BINARY_DIR}/generated/copyright "${notice}
License: Apache-2.0, whose text is in /usr/share/common-licenses/Apache-2.0.

Reports that the programs write contain dygraphs (https://dygraphs.com):

${dygraphs}

The page of youbotd contains three.js (https://threejs.org):

${three}")
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} COMPONENT)
  install(FILES ${PROJECT_BINARY_DIR}/generated/copyright
          DESTINATION share/doc/${CPACK_DEBIAN_${COMPONENT}_PACKAGE_NAME} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
include(CPack)
