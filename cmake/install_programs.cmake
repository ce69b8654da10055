# cmake --install DIR --prefix PREFIX. udev reads rules below /usr and /usr/local; for any other prefix they
# are put where udev does not look unless this is /etc/udev/rules.d.
set(YOUBOT_UDEV_RULES_DIR lib/udev/rules.d CACHE STRING "Where the udev rules go; below the prefix unless absolute")
file(GLOB udev_rules CONFIGURE_DEPENDS udev/*.rules)
set(programs youbotd youbotctl youbot-bench youbot-sim youbot-gap)
# As `--strip` does: symbols are most of a program, and stay in the build folder.
install(CODE "set(CMAKE_INSTALL_DO_STRIP TRUE)" COMPONENT programs)
install(TARGETS ${programs} RUNTIME DESTINATION bin COMPONENT programs)
install(FILES ${udev_rules} DESTINATION ${YOUBOT_UDEV_RULES_DIR} COMPONENT programs)
install(FILES apps/youbotd/demo.toml apps/youbotd/teleop.toml apps/youbot_gap/known_wheel.toml
              control/youbot.urdf control/youbot_arm.toml
        DESTINATION share/youbot-hal COMPONENT programs)
install(DIRECTORY apps/youbot_sim/thesis DESTINATION share/youbot-hal COMPONENT programs)

# Each program writes its manual page and its completion itself, from the options that it reads.
foreach(program IN LISTS programs)
  set(generated ${PROJECT_BINARY_DIR}/generated/${program})
  install(CODE "execute_process(COMMAND $<TARGET_FILE:${program}> --generate man COMMAND gzip -9n
                OUTPUT_FILE ${generated}.1.gz COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND $<TARGET_FILE:${program}> --generate bash-completion
                OUTPUT_FILE ${generated} COMMAND_ERROR_IS_FATAL ANY)" COMPONENT programs)
  install(FILES ${generated}.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs)
  install(FILES ${generated} DESTINATION share/bash-completion/completions COMPONENT programs)
endforeach()
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/generated)

# Documents, in the folders that they link to each other by, name programs and files where they are installed.
set(documents README.md apps/FILE_FORMATS.md apps/youbotd/README.md apps/youbot_bench/README.md
              apps/youbot_gap/README.md apps/youbot_sim/README.md drivers/haptic/README.md
              examples/README.md python/README.md udev/raw-socket.md tests/data/README.md LICENSE NOTICE CHANGELOG.md
              CONTRIBUTING.md docs/architecture.md docs/bounds.md docs/emulated_bus.md docs/frames.md docs/glossary.md docs/library.md
              docs/robot.md docs/safety.md docs/speed.md docs/status.md docs/two-stations.md)
install(CODE "set(DOCUMENTS \"${documents}\")
set(SOURCE \"${PROJECT_SOURCE_DIR}\")
set(OUTPUT \"${PROJECT_BINARY_DIR}/generated/doc\")
include(\"${PROJECT_SOURCE_DIR}/cmake/installed_documents.cmake\")" COMPONENT documents)
install(DIRECTORY ${PROJECT_BINARY_DIR}/generated/doc/ DESTINATION share/doc/youbot-hal COMPONENT documents)
install(FILES docs/page.png DESTINATION share/doc/youbot-hal/docs COMPONENT documents)

# The service. Its unit names the program where it is installed, which the prefix of `cmake --install` decides.
# systemd looks where udev does: below /usr and /usr/local, else in /etc/systemd/system and /etc/sysusers.d.
set(YOUBOT_SYSTEMD_UNIT_DIR lib/systemd/system CACHE STRING "Where the unit goes; below the prefix unless absolute")
set(YOUBOT_SYSUSERS_DIR lib/sysusers.d CACHE STRING "Where its user is declared; below the prefix unless absolute")
install(CODE "set(PREFIX \"\${CMAKE_INSTALL_PREFIX}\")
configure_file(${PROJECT_SOURCE_DIR}/apps/youbotd/youbotd.service.in ${PROJECT_BINARY_DIR}/youbotd.service @ONLY)"
        COMPONENT programs)
install(FILES ${PROJECT_BINARY_DIR}/youbotd.service DESTINATION ${YOUBOT_SYSTEMD_UNIT_DIR} COMPONENT programs)
install(FILES apps/youbotd/youbotd.sysusers.conf RENAME youbotd.conf DESTINATION ${YOUBOT_SYSUSERS_DIR}
        COMPONENT programs)
