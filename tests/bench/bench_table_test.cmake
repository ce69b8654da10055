# The table contains the output of a benchmark: cmake -DBENCH=... -DTABLE=... -DSCRATCH=... -P
file(REMOVE_RECURSE ${SCRATCH})
file(MAKE_DIRECTORY ${SCRATCH})
set(ENV{YOUBOT_FIGURES} ${SCRATCH}/figures.tsv)
execute_process(COMMAND ${BENCH} --benchmark_filter=^WheelCurve|^FrictionLaw --benchmark_min_time=0.001
                COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
execute_process(COMMAND ${TABLE} ${SCRATCH}/figures.tsv COMMAND_ERROR_IS_FATAL ANY OUTPUT_VARIABLE table)
message("${table}")

foreach(expected
    "^[^\n]+ cores[^\n]*; Linux [^\n]+; [^;\n]+; youbot-hal [^\n]+\n\n[|] what +[|] figure +[|] how +[|]\n[|] -+ [|] -+ [|] -+ [|]\n"
    "\n[|] wheel curve from the table +[|] [0-9.]+ (n|µ)s +[|] bench WheelCurveFromTable, [0-9]+ times +[|]\n"
    "\n[|] step of a friction law +[|] [0-9.]+ (n|µ)s \\([a-z_]+\\) to [0-9.]+ (n|µ)s \\([a-z_]+\\) +[|] bench FrictionLaw, the ends of [0-9]+ +[|]\n")
  if(NOT table MATCHES "${expected}")
    message(FATAL_ERROR "no such line: ${expected}")
  endif()
endforeach()

execute_process(COMMAND ${TABLE} ${SCRATCH}/missing.tsv RESULT_VARIABLE code ERROR_VARIABLE words)
if(NOT code EQUAL 2 OR NOT words MATCHES "missing.tsv: no figures")
  message(FATAL_ERROR "without figures: ${code}, ${words}")
endif()
