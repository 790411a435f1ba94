// What a call is told by the program that makes it, and what it tells meanwhile.
#pragma once

#include <cstdint>
#include <string>

#include "limber/export.h"

namespace limber {

// Derive from it, and override what you want to hear. Several threads call, progress() and warn() one at a
// time. What they throw is not caught.
class LIMBER_API Watcher {
 public:
  virtual ~Watcher();
  // So much of a stage is done; `total` 0: nobody knows of how much. At most ten times a second. A stage may
  // end before all is done: a search that has found its goal.
  virtual void progress(const std::string& stage, std::int64_t done, std::int64_t total,
                        const std::string& note);
  // Something that the user should know, and that ends nothing.
  virtual void warn(const std::string& text);
  // True ends the call by Interrupted, soon; a search keeps what it has found, and says so. Asked often.
  virtual bool stop();
};

// On whose behalf a call works. Results depend on none of it.
struct Context {
  Watcher* watcher = nullptr;  // it outlives the call
  int threads = 0;             // at most so many, up to 256; 0: as many as the machine has
};

}  // namespace limber
