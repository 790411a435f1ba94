// The models of a batch: files, folders, @lists, and the names that their results get.
#pragma once

#include <string>
#include <vector>

#include "core/file.h"
#include "limber/batch.h"

namespace limber::detail {

// In the order given, those of a folder by their paths; each file once. Folders are searched to their ends
// for files with endings of models, but for hidden ones, links to folders, and those in `but_not`. A list has
// a path a line, or between NULs, seen from the folder that limber runs in; what it names may be missing.
// Throws InputError for a word that names nothing, a folder without models, an empty list.
std::vector<ListedModel> list_models(const std::vector<std::string>& words,
                                     const std::vector<fs::path>& but_not);

}  // namespace limber::detail
