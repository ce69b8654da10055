# Installs into a scratch directory, checks the files, and runs the programs.
cmake_minimum_required(VERSION 3.25)

# Redirects absolute paths below it, too.
file(REMOVE_RECURSE ${SCRATCH})
set(ENV{DESTDIR} ${SCRATCH})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix /usr
                OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "cmake --install failed:\n${output}")
endif()

cmake_path(ABSOLUTE_PATH RULES_DIR BASE_DIRECTORY /usr)
file(GLOB rules RELATIVE ${ROOT}/udev ${ROOT}/udev/*.rules)
list(TRANSFORM rules PREPEND ${RULES_DIR}/ OUTPUT_VARIABLE installed_rules)
set(programs youbotd youbotctl youbot-bench youbot-sim youbot-gap)
list(TRANSFORM programs PREPEND /usr/bin/ OUTPUT_VARIABLE installed_programs)
list(TRANSFORM programs PREPEND /usr/share/bash-completion/completions/ OUTPUT_VARIABLE completions)
list(TRANSFORM programs REPLACE "(.+)" "/usr/share/man/man1/\\1.1.gz" OUTPUT_VARIABLE pages)
cmake_path(ABSOLUTE_PATH UNIT_DIR BASE_DIRECTORY /usr)
cmake_path(ABSOLUTE_PATH SYSUSERS_DIR BASE_DIRECTORY /usr)
# In the folders that their links to each other expect.
set(documents README.md apps/FILE_FORMATS.md apps/youbotd/README.md apps/youbot_bench/README.md
              apps/youbot_gap/README.md apps/youbot_sim/README.md drivers/haptic/README.md
                 examples/README.md python/README.md udev/raw-socket.md tests/data/README.md LICENSE NOTICE CHANGELOG.md CONTRIBUTING.md
                 docs/architecture.md docs/bounds.md docs/emulated_bus.md docs/frames.md docs/glossary.md docs/library.md docs/robot.md
                 docs/safety.md docs/speed.md docs/status.md docs/two-stations.md docs/page.png)
list(TRANSFORM documents PREPEND /usr/share/doc/youbot-hal/)
set(expected ${installed_programs} ${installed_rules} ${UNIT_DIR}/youbotd.service ${SYSUSERS_DIR}/youbotd.conf
             ${pages} ${completions}
             /usr/share/youbot-hal/demo.toml
             /usr/share/youbot-hal/known_wheel.toml
             /usr/share/youbot-hal/teleop.toml
             /usr/share/youbot-hal/thesis/wheel-1.toml
             /usr/share/youbot-hal/thesis/wheel-2.toml
             /usr/share/youbot-hal/thesis/wheel-3.toml
             /usr/share/youbot-hal/thesis/wheel-4.toml
             /usr/share/youbot-hal/youbot.urdf
             /usr/share/youbot-hal/youbot_arm.toml
             ${documents})
file(GLOB_RECURSE found ${SCRATCH}/*)
list(TRANSFORM found REPLACE "^${SCRATCH}" "")
# tests/outside, tests/packaging
list(FILTER found EXCLUDE REGEX "^/usr/(include/youbot-hal|lib/[^/]*/?(cmake/youbot|pkgconfig|libyoubot)|share/doc/youbot-hal/(python/)?examples/[^R]|lib/python3/dist-packages)")
list(SORT expected)
list(SORT found)
if(NOT found STREQUAL expected)
  message(FATAL_ERROR "Installed:\n  ${found}\nexpected:\n  ${expected}")
endif()
foreach(rule 60-3dconnexion-spacemouse 60-force-dimension 60-novint-falcon)
  if(NOT EXISTS ${SCRATCH}${RULES_DIR}/${rule}.rules)
    message(FATAL_ERROR "${rule}.rules is missing")
  endif()
endforeach()

foreach(program IN LISTS programs)
  execute_process(COMMAND ${SCRATCH}/usr/bin/${program} --help
                  OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE result)
  if(NOT result EQUAL 0 OR NOT output MATCHES "Usage: .*${program}")
    message(FATAL_ERROR "${program} --help ended with ${result}:\n${output}")
  endif()
endforeach()

# The installed program reads this configuration.
execute_process(COMMAND ${SCRATCH}/usr/bin/youbotd --config ${SCRATCH}/usr/share/youbot-hal/demo.toml
                        --virtual-time --duration 0.1
                OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "youbotd with the installed configuration ended with ${result}:\n${output}")
endif()

file(REMOVE_RECURSE ${SCRATCH})
