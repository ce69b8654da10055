# Tests that layers.cmake rejects each kind of violation and accepts the rest:
# cmake -DSCRATCH=<folder to write into> -P layers_selftest.cmake
cmake_minimum_required(VERSION 3.25)

# File and include, one pair a line, in the order in which violations are listed.
set(refused
  analysis/a.cpp          "\"operation/config.h\""
  apps/youbotd/a.cpp      "\"tests/support/no_alloc_guard.h\""
  apps/youbotd/b.cpp      "<gtest/gtest.h>"
  apps/youbotd/c.cpp      "<undeclared/library.h>"
  apps/youbotd/d.cpp      "\"apps/youbotctl/client.h\""
  control/a.h             "\"hal/robot.h\""
  control/b.cpp           "<thread>"
  control/c.cpp           "<fstream>"
  control/d.cpp           "<iostream>"
  control/e.cpp           "<time.h>"
  control/f.cpp           "<spdlog/spdlog.h>"
  drivers/can/a.cpp       "<spdlog/spdlog.h>"
  drivers/ethercat/a.cpp  "<Eigen/Core>"
  drivers/ethercat/b.cpp  "\"drivers/tmcl/telegram.h\""
  drivers/ethercat/c.cpp  "<libusb-1.0/libusb.h>"
  drivers/ethercat/d.cpp  "<libusb.h>"
  drivers/haptic/a.cpp    "\"sim/arm.h\""
  drivers/haptic/b.cpp    "\"runtime/configuration/toml_reader.h\""
  drivers/tmcl/a.h        "\"hal/robot.h\""
  drivers/usb/a.cpp       "\"control/limits.h\""
  examples/a.cpp          "\"hal/robot.h\""
  hal/a.h                 "\"drivers/ethercat/master.h\""
  hal/b.cpp               "\"control/limits.h\""
  hal/c.cpp               "\"sim/base.h\""
  hal/d.cpp               "\"runtime/configuration/toml_reader.h\""
  hal/e.cpp               "<toml++/toml.h>"
  hal/f.cpp               "<CLI/CLI.hpp>"
  hal/g.cpp               "\"robot.h\""
  hal/h.h                 "\"hal/../drivers/ethercat/master.h\""
  hal/i.cpp               "\"tests/support/no_alloc_guard.h\""
  identification/a.cpp    "\"runtime/recording/recording_reader.h\""
  identification/b.cpp    "\"hal/robot.h\""
  model/a.h               "\"control/limits.h\""
  model/b.cpp             "<fstream>"
  operation/a.cpp         "\"apps/youbotd/service.h\""
  report/a.cpp            "\"operation/report.h\""
  sim/a.h                 "\"hal/robot.h\""
  sim/b.cpp               "\"drivers/ethercat/master.h\""
  sim/c.cpp               "<toml++/toml.h>"
  sim/d.cpp               "<hidapi/hidapi.h>"
  sim/e.cpp               "\"runtime/configuration/toml_reader.h\""
  sim/f.cpp               "\"identification/gap/gap.h\"")
set(allowed
  drivers/ethercat/a.cpp  "<linux/if_packet.h>"
  drivers/ethercat/b.cpp  "\"drivers/ethercat/frame.h\""
  drivers/tmcl/a.h        "\"drivers/ethercat/mailbox.h\""
  drivers/usb/a.cpp       "<libusb-1.0/libusb.h>"
  drivers/haptic/a.cpp    "<hidapi/hidapi.h>"
  hal/a.h                 "<Eigen/Core>"
  hal/b.cpp               "\"drivers/ethercat/master.h\""
  hal/c.cpp               "<time.h>"
  control/a.h             "<kdl/chain.hpp>"
  control/b.cpp           "<cmath>"
  sim/a.h                 "\"control/link_map.h\""
  sim/b.h                 "\"hal/plant.h\""
  sim/c.cpp               "\"drivers/haptic/falcon_wire.h\""
  sim/d.cpp               "\"drivers/tmcl/telegram.h\""
  sim/e.cpp               "\"model/drive_model.h\""
  identification/gap/a.cpp "<unsupported/Eigen/FFT>"
  identification/fit/a.cpp "<ceres/ceres.h>"
  apps/youbotd/a.cpp      "<toml++/toml.h>"
  examples/a.cpp          "<youbot/robot.h>"
  apps/youbotd/b.cpp      "\"hal/robot.h\""
  apps/youbotd/c.cpp      "\"apps/youbotd/service.h\""
  apps/youbot_bench/a.cpp "\"operation/session.h\""
  tests/hal/a.cpp         "\"operation/config.h\"")

# Writes the pairs of that list as a source tree; sets `output` and `result` from checking it and
# `violations` to the expected output if each of its includes were rejected.
function(check_tree list)
  set(root ${SCRATCH}/${list})
  file(REMOVE_RECURSE ${root})
  file(MAKE_DIRECTORY ${root})
  set(violations "")
  while(${list})
    list(POP_FRONT ${list} file include)
    file(WRITE ${root}/${file} "// #include <Eigen/Core> is only a comment here\n  # include ${include}  // why\n")
    string(REGEX REPLACE "[<>\"]" "" include "${include}")
    string(APPEND violations "${file}:2: may not include ${include}\n")
  endwhile()
  execute_process(COMMAND ${CMAKE_COMMAND} -DROOT=${root} -P ${CMAKE_CURRENT_LIST_DIR}/layers.cmake
    ERROR_VARIABLE output RESULT_VARIABLE result)
  return(PROPAGATE violations output result)
endfunction()

check_tree(refused)
string(FIND "${output}" "${violations}" position)
if(result EQUAL 0 OR NOT position EQUAL 0)
  message(FATAL_ERROR "expected\n${violations}\nfound\n${output}")
endif()

check_tree(allowed)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "expected no complaint, found\n${output}")
endif()

check_tree(nothing)
if(result EQUAL 0)
  message(FATAL_ERROR "an empty tree, as under a wrong ROOT, must not pass")
endif()
