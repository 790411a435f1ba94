// Whoever makes a folder's files anew has it alone.
#pragma once

#include "core/file.h"

namespace limber {

// flock(2) on the folder itself: it leaves no file, and ends with the process however that ends. Where a file
// system knows no such locks, nothing is locked.
class FolderLock {
 public:
  enum Kind { alone, shared };  // shared: with others that share
  enum Patience { at_once, waits };
  // Throws InputError, or waits where it has the patience, while another holds what does not go with this.
  // The folder is there. Throws Interrupted while it waits.
  FolderLock(const fs::path& folder, Kind, Patience = at_once);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  void share();  // from now on

 private:
  int descriptor_;
};

}  // namespace limber
