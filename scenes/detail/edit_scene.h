// What is done to a scene's text, as a tree of values, before it is checked: edits by --set, and lists from a
// file of their own (--control). So there is one road for a parameter, and one check. What edits may say:
// docs/scene.md, "Edits".
#pragma once

#include "scenes/detail/document.h"
#include "scenes/scene.h"

namespace limber::scenes {

// `set` is "a.b.c=value", as read_scene() has it. Throws InputError that begins with "--set a.b.c=value".
void edit(Node& root, const std::string& set);

// Puts the [[forces]], [[pressures]] and [[motions]] of a script behind the scene's own.
void append(const ScriptText&, Node& root);

}  // namespace limber::scenes
