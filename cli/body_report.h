// A body's report.json as a few lines.
#pragma once

#include <string>

#include "core/json.h"

namespace limber::cli {

std::string text_of_report(const Json& report);

}  // namespace limber::cli
