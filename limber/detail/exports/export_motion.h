// The motion of a work folder as files for other programs. docs/files.md says what is in them.
#pragma once

#include "limber/detail/exports/motion_files.h"

namespace limber::detail {

// Throws InputError, DiskError.
ExportedMotion export_motion(const ExportOptions&);

}  // namespace limber::detail
