#include "apps/common/build_info.h"

namespace apps {

const char* build_version() noexcept { return YOUBOT_VERSION; }

}  // namespace apps
