# Writes the source of runtime::build_version() when it changed: cmake -DROOT=... -DVERSION=... -DOUTPUT=... -P
execute_process(COMMAND git describe --always --dirty WORKING_DIRECTORY ${ROOT}
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT commit)
  set(commit "no commit")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [[
#include "runtime/program/build_info.h"

namespace runtime {

const char* build_version() noexcept { return "@VERSION@ (@commit@)"; }

}  // namespace runtime
]] @ONLY)
