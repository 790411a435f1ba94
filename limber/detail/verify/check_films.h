// That films show what they are said to show: nothing that they say of themselves is taken for granted.
#pragma once

#include "core/file.h"
#include "limber/detail/verify/promises.h"

namespace limber::detail {

// Of each film that the folder's manifest.json tells of: that it is of this plan, that every frame says the
// hash of what it should show and has the pixels that it says, that `repaint` of them, painted again, have
// the same, and that film and contact sheet, made again from the frames, are the same. Throws InputError
// where there is none, Interrupted.
void check_films(const fs::path& folder, int repaint, Promises&);

}  // namespace limber::detail
