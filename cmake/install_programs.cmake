# cmake --install DIR --prefix PREFIX. udev reads rules below /usr and /usr/local; for any other prefix they
# are put where udev does not look unless this is /etc/udev/rules.d.
set(YOUBOT_UDEV_RULES_DIR lib/udev/rules.d CACHE STRING "Where the udev rules go; below the prefix unless absolute")
file(GLOB udev_rules CONFIGURE_DEPENDS udev/*.rules)
install(TARGETS youbotd youbotctl youbot-bench youbot-sim youbot-gap RUNTIME DESTINATION bin)
install(FILES ${udev_rules} DESTINATION ${YOUBOT_UDEV_RULES_DIR})
install(FILES apps/youbotd/demo.toml apps/youbotd/teleop.toml DESTINATION share/youbot-hal)
foreach(document README.md apps/FILE_FORMATS.md apps/youbotd/README.md apps/youbot_bench/README.md
                 apps/youbot_gap/README.md apps/youbot_sim/README.md drivers/haptic/README.md
                 examples/README.md udev/raw-socket.md tests/data/README.md LICENSE NOTICE CHANGELOG.md CONTRIBUTING.md
                 docs/architecture.md docs/bounds.md docs/emulated_bus.md docs/frames.md docs/glossary.md docs/robot.md
                 docs/safety.md docs/speed.md docs/status.md)
  cmake_path(GET document PARENT_PATH folder)
  install(FILES ${document} DESTINATION share/doc/youbot-hal/${folder})
endforeach()

# The service. Its unit names the program where it is installed, which the prefix of `cmake --install` decides.
# systemd looks where udev does: below /usr and /usr/local, else in /etc/systemd/system and /etc/sysusers.d.
set(YOUBOT_SYSTEMD_UNIT_DIR lib/systemd/system CACHE STRING "Where the unit goes; below the prefix unless absolute")
set(YOUBOT_SYSUSERS_DIR lib/sysusers.d CACHE STRING "Where its user is declared; below the prefix unless absolute")
install(CODE "set(PREFIX \"\${CMAKE_INSTALL_PREFIX}\")
configure_file(${PROJECT_SOURCE_DIR}/apps/youbotd/youbotd.service.in ${PROJECT_BINARY_DIR}/youbotd.service @ONLY)")
install(FILES ${PROJECT_BINARY_DIR}/youbotd.service DESTINATION ${YOUBOT_SYSTEMD_UNIT_DIR})
install(FILES apps/youbotd/youbotd.sysusers.conf RENAME youbotd.conf DESTINATION ${YOUBOT_SYSUSERS_DIR})
