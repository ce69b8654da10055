# Libraries, headers, find_package(youbot) and pkg-config. Identification is a component of its own, since it needs Ceres.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/youbot)
list(TRANSFORM library_layers PREPEND youbot_ OUTPUT_VARIABLE library_targets)
install(TARGETS ${library_targets} youbot_youbot EXPORT youbot
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(EXPORT youbot NAMESPACE youbot:: FILE youbot-targets.cmake DESTINATION ${package_dir} COMPONENT development)
set(installed_headers ${library_layers})
if(YOUBOT_IDENTIFICATION)
  install(TARGETS youbot_identification EXPORT youbot-identification
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT youbot-identification NAMESPACE youbot:: FILE youbot-identification-targets.cmake
          DESTINATION ${package_dir} COMPONENT development)
  list(APPEND installed_headers identification)
endif()
install(DIRECTORY ${installed_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/youbot-hal COMPONENT development
        FILES_MATCHING PATTERN "*.h" PATTERN force_dimension_stand_in EXCLUDE)
install(FILES identification/recording.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/youbot-hal/identification
        COMPONENT development)
install(DIRECTORY include/youbot DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/youbot-hal COMPONENT development)
install(DIRECTORY examples DESTINATION share/doc/youbot-hal COMPONENT development PATTERN README.md EXCLUDE)

configure_package_config_file(cmake/youbot-config.cmake.in ${PROJECT_BINARY_DIR}/youbot-config.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/youbot-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/youbot-config.cmake ${PROJECT_BINARY_DIR}/youbot-config-version.cmake
        DESTINATION ${package_dir} COMPONENT development)

# Static libraries, each behind those that use it.
set(reversed ${library_layers})
list(REVERSE reversed)
list(TRANSFORM reversed PREPEND -lyoubot_ OUTPUT_VARIABLE pkg_config_libraries)
list(JOIN pkg_config_libraries " " pkg_config_libraries)
install(CODE "set(LIBDIR \"${CMAKE_INSTALL_LIBDIR}\")
set(INCLUDEDIR \"${CMAKE_INSTALL_INCLUDEDIR}\")
set(PREFIX \"\${CMAKE_INSTALL_PREFIX}\")
cmake_path(ABSOLUTE_PATH LIBDIR BASE_DIRECTORY \${PREFIX})
cmake_path(ABSOLUTE_PATH INCLUDEDIR BASE_DIRECTORY \${PREFIX})
set(VERSION \"${PROJECT_VERSION}\")
set(LIBRARIES \"${pkg_config_libraries}\")
configure_file(${PROJECT_SOURCE_DIR}/cmake/youbot.pc.in ${PROJECT_BINARY_DIR}/youbot.pc @ONLY)" COMPONENT development)
install(FILES ${PROJECT_BINARY_DIR}/youbot.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
