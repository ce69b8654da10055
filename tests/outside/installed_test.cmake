# Installs into a folder, builds the examples against it by find_package(), and runs them; then the program in
# docs/library.md, by find_package() and by pkg-config.
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
file(REMOVE_RECURSE ${SCRATCH})
run("install" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/prefix)

# A copy, so that no file of the source tree is found next to it.
file(COPY ${ROOT}/examples DESTINATION ${SCRATCH})
run("configure" ${CMAKE_COMMAND} -S ${SCRATCH}/examples -B ${SCRATCH}/build -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Debug)
run("build" ${CMAKE_COMMAND} --build ${SCRATCH}/build --target example_read_state example_identify_model)
run("read_state" ${SCRATCH}/build/read_state)
expect("wheel-4")
run("identify_model" ${SCRATCH}/build/identify_model loopback ${SCRATCH}/model.toml)
expect("coulomb torque_Nm")

# The program in docs/library.md, from an empty folder.
file(READ ${ROOT}/docs/library.md page)
foreach(block cmake cpp)
  string(REGEX MATCH "```${block}\n([^`]+)```" unused "${page}")
  set(${block} "${CMAKE_MATCH_1}")
endforeach()
file(WRITE ${SCRATCH}/mine/CMakeLists.txt "${cmake}")
file(WRITE ${SCRATCH}/mine/mine.cpp "${cpp}")
run("configure mine" ${CMAKE_COMMAND} -S ${SCRATCH}/mine -B ${SCRATCH}/mine/build
    -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix -DCMAKE_CXX_COMPILER=${COMPILER})
run("build mine" ${CMAKE_COMMAND} --build ${SCRATCH}/mine/build)
run("mine" ${SCRATCH}/mine/build/mine)
# A quarter of a turn, within what friction holds against the spring: 0.09 N·m over 1 N·m/rad.
string(REGEX MATCH "turned ([0-9.]+) rad" unused "${output}")
if(NOT CMAKE_MATCH_1 GREATER 1.48 OR NOT CMAKE_MATCH_1 LESS 1.67)
  message(FATAL_ERROR "mine: ${output}")
endif()

# The same program by the page's command with pkg-config.
file(GLOB_RECURSE pkg_config ${SCRATCH}/prefix/*/youbot.pc)
cmake_path(GET pkg_config PARENT_PATH folder)
set(ENV{PKG_CONFIG_PATH} ${folder})
string(REGEX MATCH "```sh\n *g\\+\\+ ([^\n]+)\n" unused "${page}")
run("pkg-config" sh -c "cd '${SCRATCH}/mine' && '${COMPILER}' ${CMAKE_MATCH_1}")
run("mine, by pkg-config" ${SCRATCH}/mine/mine)
expect("wheel 1 turned 1.")

run("uninstall" ${CMAKE_COMMAND} -DPREFIX=${SCRATCH}/prefix -P ${ROOT}/cmake/uninstall.cmake)
file(GLOB_RECURSE left ${SCRATCH}/prefix/*)
file(GLOB_RECURSE folders LIST_DIRECTORIES true RELATIVE ${SCRATCH}/prefix ${SCRATCH}/prefix/*)
list(FILTER folders INCLUDE REGEX "youbot")
if(left OR folders)
  message(FATAL_ERROR "uninstall left ${left} ${folders}:\n${output}")
endif()
file(REMOVE_RECURSE ${SCRATCH})
