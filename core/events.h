// What goes on, for programs that watch (--progress): a line of JSON for each event, as it happens.
// docs/cli.md lists them.
#pragma once

#include <string>

#include "core/json.h"

namespace limber::events {

// "json": to stderr, where all else is silent but that warnings are events, too. Else a file, made anew.
// Empty: nothing is told. Throws DiskError when the file cannot be made.
void set_up(const std::string& where);
bool wanted();

// Adds the line and flushes it; any thread may. Where it cannot be written, that is said once, and no more is
// told: work does not end for it.
void tell(const Json&);

}  // namespace limber::events
