# A project that adds this one as a subdirectory gets a library that drives a robot: no tests, no Ceres, none of our
# warnings, and no conflict of target names.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
file(REMOVE_RECURSE ${SCRATCH})
file(WRITE ${SCRATCH}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(outside LANGUAGES CXX)
set(CMAKE_DISABLE_FIND_PACKAGE_Ceres ON)
set(CMAKE_DISABLE_FIND_PACKAGE_GTest ON)
set(CMAKE_DISABLE_FIND_PACKAGE_benchmark ON)
set(CMAKE_DISABLE_FIND_PACKAGE_CLI11 ON)
add_subdirectory(${ROOT} youbot EXCLUDE_FROM_ALL)
add_executable(mine mine.cpp)
target_link_libraries(mine PRIVATE youbot::youbot)
add_library(control INTERFACE)  # names that a robot project is likely to use
add_library(drivers INTERFACE)
add_executable(outside main.cpp)
target_link_libraries(outside PRIVATE youbot::youbot control drivers)
target_compile_options(outside PRIVATE -Werror)
")
file(WRITE ${SCRATCH}/main.cpp "#include <youbot/loopback.h>
#include <youbot/robot.h>

#include <cstdio>

int main() {
  int unused;  // with a warning of ours this would not compile
  youbot::VirtualClock clock;
  const youbot::OpenedRobot opened = youbot::open_robot({}, clock, std::chrono::milliseconds(1));
  std::printf(\"%zu joints\\n\", opened.robot->joints().size());
}
")
# The program in docs/library.md.
file(READ ${ROOT}/docs/library.md page)
string(REGEX MATCH "```cpp\n([^`]+)```" unused "${page}")
file(WRITE ${SCRATCH}/mine.cpp "${CMAKE_MATCH_1}")
run("configure" ${CMAKE_COMMAND} -S ${SCRATCH} -B ${SCRATCH}/build -DCMAKE_CXX_COMPILER=${COMPILER}
    -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
run("build" ${CMAKE_COMMAND} --build ${SCRATCH}/build --target outside mine)
run("outside" ${SCRATCH}/build/outside)
expect("4 joints")
run("mine" ${SCRATCH}/build/mine)
expect("wheel 1 turned 1.")
file(REMOVE_RECURSE ${SCRATCH})
