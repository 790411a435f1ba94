#pragma once

namespace limber {
extern const char* const version;  // "0.1.0", from CMake
}
