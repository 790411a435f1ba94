#include "core/version.h"

namespace limber {
const char* const version = LIMBER_VERSION;
}
