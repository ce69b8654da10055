# Fails when an include crosses the layers: cmake -DROOT=<source tree> -P layers.cmake
# An include that is neither a standard nor an OS header must match the line of its folder below, so that a new
# dependency is declared here first. tests/ may include everything and is not checked.
cmake_minimum_required(VERSION 3.25)

# Pattern of the including file, pattern of what it may include. The first match counts.
set(plain_values "hal/(plant|joint|hand_plant|seconds)\\.h$|drivers/.*(_wire|/frame|/registers|/lock_step|/al_status|/link|/telegram|/process_data|/status_flags|/axis_parameters?|/firmware_version|/usb_port|/youbot_kind)\\.h$")
set(rules
  "^drivers/[^/]+$"     "^drivers/[^/]+$"
  "^drivers/ethercat/"  "^drivers/(ethercat/|(interface_lock|latency_histogram|packet_age|uninterrupted)\\.h)"
  "^drivers/tmcl/"      "^drivers/"
  "^drivers/can/"       "^drivers/(can/|(interface_lock|packet_age|setup_error|uninterrupted)\\.h)"
  "^drivers/station/(key|session)\\.cpp$" "^(drivers/(station/|(setup_error|uninterrupted)\\.h)|sodium\\.h$)"
  "^drivers/station/"   "^drivers/(station/|haptic/haptic_fault\\.h|(setup_error|uninterrupted)\\.h)"
  "^drivers/usb/"       "^(drivers/usb|libusb-1\\.0)/"
  "^drivers/haptic/"    "^((drivers/usb|drivers/haptic|libusb-1\\.0|hidapi)/|drivers/(setup_error|uninterrupted)\\.h)"
  "^hal/(ethercat|haptic)/" "^(hal|Eigen|drivers)/"
  # A part of the robots on EtherCAT and CAN.
  "^hal/hall_reader\\.h$" "^(hal|drivers)/"
  "^hal/.*\\.h$"        "^((hal|Eigen)/|drivers/(tmcl/youbot_kind|haptic/haptic_fault)\\.h$)"
  "^hal/.*\\.cpp$"      "^(hal|Eigen|drivers)/"
  "^model/"             "^(model|Eigen)/"
  # Its subject is what the HAL's robots report.
  "^control/plausibility/" "^((control|Eigen)/|hal/(joint|robot)\\.h$)"
  "^control/"           "^(control|model|Eigen|kdl|urdf_parser)/"
  "^sim/"               "^((sim|control|model|Eigen)/|${plain_values})"
  "^identification/"    "^((identification|sim|control|model|Eigen|unsupported/Eigen|ceres)/|${plain_values})"
  # A recording is read into what identification works on.
  "^runtime/recording/recording_reader\\.h$" "^(runtime/|identification/recording\\.h$)"
  "^runtime/mcap/compression\\.cpp$" "^(runtime/|zstd\\.h$|lz4frame\\.h$)"
  "^runtime/"           "^(runtime|sim|control|model|hal|drivers|Eigen|kdl|spdlog|toml\\+\\+|CLI|nlohmann)/"
  "^report/"            "^(report|runtime)/"
  "^live/web_server\\.cpp$" "^(live|runtime|hal|boost|spdlog)/"
  "^live/transforms\\.cpp$" "^(live|urdf_parser)/"
  "^live/"              "^(live|runtime|hal|Eigen|nlohmann)/"
  "^ros2/"              "^(ros2|live|runtime|hal|dds|spdlog)/"
  "^operation/"         "^(operation|live|report|runtime|sim|control|model|hal|drivers|Eigen|spdlog|toml\\+\\+|nlohmann)/"
  "^analysis/"          "^(analysis|report|runtime|identification|model|hal|Eigen|spdlog|nlohmann)/"
  # No program includes another: @1 is its own folder.
  "^apps/youbotd/"      "^(apps/youbotd|ros2|operation|live|analysis|report|runtime|identification|sim|control|model|hal|drivers|Eigen|kdl|spdlog|toml\\+\\+|CLI|nlohmann)/"
  "^apps/([a-z_]+)/"    "^(apps/@1|operation|live|analysis|report|runtime|identification|sim|control|model|hal|drivers|Eigen|kdl|spdlog|toml\\+\\+|CLI|nlohmann)/")
# The examples use the public interface only.
list(APPEND rules "^examples/"         "^(youbot/|example_robot\\.h$)"
                  "^include/youbot/"   "^(youbot|runtime|identification|sim|control|model|hal|drivers)/")
set(standard "^<[a-z0-9_]+$")
set(operating_system "^<((sys|linux|net|netinet|netpacket|arpa)/.+|[a-z]+\\.h)$")
# A control step is a function of (config, state, input, dt): no clock, thread or file.
set(not_in_control "^<(iostream|fstream|cstdio|filesystem|ctime|thread|.*mutex|condition_variable|future)$")

file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/*.h ${ROOT}/*.cpp)
list(FILTER files INCLUDE REGEX "^(drivers|hal|model|control|sim|identification|runtime|report|live|ros2|operation|analysis|apps|examples|include)/")
execute_process(
  COMMAND grep -noHE "^[[:space:]]*#[[:space:]]*include[[:space:]]*[<\"][^>\"]+" ${files}
  WORKING_DIRECTORY ${ROOT} OUTPUT_VARIABLE includes RESULT_VARIABLE result)
if(NOT files OR NOT result EQUAL 0)
  message(FATAL_ERROR "No includes found under '${ROOT}'")
endif()

string(REGEX MATCHALL "[^\n]+" includes "${includes}")
set(violations "")
foreach(include IN LISTS includes)  # such as: hal/robot.h:12:#include <Eigen/Core
  string(REGEX MATCH "^([^:]+):([0-9]+):[^<\"]+([<\"](.+))$" include "${include}")
  set(file ${CMAKE_MATCH_1})
  set(line ${CMAKE_MATCH_2})
  set(header "${CMAKE_MATCH_3}")
  set(path "${CMAKE_MATCH_4}")

  set(allowed "^$")
  set(rest ${rules})
  while(rest)
    list(POP_FRONT rest pattern allowance)
    if(file MATCHES "${pattern}")
      string(REPLACE "@1" "${CMAKE_MATCH_1}" allowed "${allowance}")
      break()
    endif()
  endwhile()

  if(file MATCHES "^(model|control)/" AND header MATCHES "${not_in_control}|${operating_system}")
  elseif(path MATCHES "${allowed}" AND NOT path MATCHES "\\.\\.")
    continue()
  elseif(header MATCHES "${standard}|${operating_system}" AND NOT header MATCHES "libusb|hidapi|zstd|sodium")
    continue()
  endif()
  list(APPEND violations "${file}:${line}: may not include ${path}")
endforeach()

if(violations)
  list(JOIN violations "\n" violations)
  message("${violations}")
  message(FATAL_ERROR "These includes cross the layers; the table is in tests/layers.cmake")
endif()
