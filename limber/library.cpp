#include "core/version.h"
#include "limber/work_folder.h"

namespace limber {

std::string library_version() { return version; }

}  // namespace limber
