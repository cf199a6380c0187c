# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD=FOLDER -DSOURCE=FOLDER -DWORK=FOLDER -DNM=NM -P build.cmake: installs BUILD, and builds the programs of
# this folder against what is installed, with CMake and by hand.
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed_here)
file(RENAME ${WORK}/installed_here ${WORK}/moved)  # nothing names the place
file(GLOB_RECURSE files RELATIVE ${WORK}/moved ${WORK}/moved/*)
set(expected include/polygmap.h include/polygmap.hpp include/polygmap_mailbox.h include/polygmap_mailbox_reader.h
             lib/cmake/polygmap/polygmapConfig.cmake
             lib/cmake/polygmap/polygmapConfigVersion.cmake lib/libpolygmap.a lib/pkgconfig/polygmap.pc)
if(NOT files STREQUAL expected)
  message(FATAL_ERROR "installed is ${files}, not ${expected}")
endif()

# Of the library's names only its own are seen, what it asks others for the C library has, and it has no variables.
execute_process(COMMAND ${NM} ${WORK}/moved/lib/libpolygmap.a OUTPUT_VARIABLE names COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" names "${names}")
set(asked "mem(cpy|move|set|cmp)|strlen|(sqrt|floor|ceil|trunc|round|rint|lrint|lround)f?|__stack_chk_fail|__assert_fail|_GLOBAL_OFFSET_TABLE_")
list(FILTER names EXCLUDE REGEX ":$| [tnrdN] | T polygmap_| U (${asked})$")
if(names)
  message(FATAL_ERROR "the installed library has the names ${names}")
endif()

file(COPY ${SOURCE}/tests/installed ${SOURCE}/docs/quick-start.md DESTINATION ${WORK})
run(${CMAKE_COMMAND} -S ${WORK}/installed -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/moved
    -DPOLYGMAP_EXAMPLE=${WORK}/quick-start.md)
run(${CMAKE_COMMAND} --build ${WORK}/build)

set(ENV{PKG_CONFIG_PATH} ${WORK}/moved/lib/pkgconfig)
execute_process(COMMAND pkg-config --cflags --libs polygmap OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(cc ${WORK}/installed/replay.c -o ${WORK}/build/replay_by_hand ${flags})
