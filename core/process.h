// Programs and processes of this machine.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/file.h"

namespace limber {

// As posix_spawnp looks for it.
bool is_in_path(const std::string& program);

// The file of the program that runs, as other processes find it.
fs::path program_file();

// When the process began, in ticks since the machine did: a number is given again, this is not. 0: it has
// ended, though nobody may have asked how yet (a zombie), or this system does not tell.
long long start_of_process(long long pid);

// False, too, where this system does not tell.
bool has_ended(long long pid);

// As execv takes it; they point into the words.
std::vector<char*> pointers_to(const std::vector<std::string>& words);

// This program once more, with these words: its id. It ends with this process, has a group of its own, for
// Ctrl-C is for this one, who tells it, reads nothing, and says what it says into two open files.
// `in_child` is called there, where only async-signal-safe functions may be.
int start_this_program(const std::vector<std::string>& words, int out, int err,
                       const std::function<void()>& in_child = {});

}  // namespace limber
