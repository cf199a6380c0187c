# SPDX-License-Identifier: Apache-2.0
# cmake -DSNIPPET=file.cpp -DCOMPILER=... -DFLAGS="a;b" -P check.cmake
# The snippet compiles with POSITIVE_CONTROL defined and fails without it, with the diagnostic that its line
# "// expect: <regular expression>" states.
file(STRINGS "${SNIPPET}" expect_line REGEX "^// expect: ")
if(NOT expect_line)
  message(FATAL_ERROR "NO EXPECTATION: ${SNIPPET} states no diagnostic")
endif()
string(REGEX REPLACE "^// expect: " "" expected "${expect_line}")

execute_process(COMMAND "${COMPILER}" ${FLAGS} -DPOSITIVE_CONTROL -fsyntax-only "${SNIPPET}"
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "BROKEN CONTROL: the right use does not compile\n${output}")
endif()
execute_process(COMMAND "${COMPILER}" ${FLAGS} -fsyntax-only "${SNIPPET}"
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0)
  message(FATAL_ERROR "COMPILED: the misuse compiles")
endif()
if(NOT output MATCHES "${expected}")
  message(FATAL_ERROR "WRONG REASON: it fails without \"${expected}\"\n${output}")
endif()
