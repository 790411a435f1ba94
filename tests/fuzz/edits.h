// Changes to good files, each drawn from a fuzzer's bytes: what is hashed or sealed is changed before that is
// done, so that what comes out gets past the door.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/json.h"
#include "core/mesh.h"
#include "core/npz.h"
#include "plan/search.h"

namespace limber::fuzz {

// The bytes as a list of choices. Once they are used up every choice is the first.
class Script {
 public:
  explicit Script(std::string_view bytes) : bytes_(bytes) {}
  bool more() const { return bytes_.size() >= 4; }  // enough for another edit
  int below(int n);                                 // 0 … n−1, n > 0
  double number(double now);                        // odd ones, neighbours of `now`, and any
  float number(float now) { return float(number(double(now))); }
  std::int64_t whole(std::int64_t now);  // as of a double, cut to 64 bits
  std::int32_t whole(std::int32_t now);  // to 32
  std::string word();                    // odd ones
  std::string_view rest(int bytes);      // the next bytes as they are, so many at most

 private:
  std::string_view bytes_;
};

// As many edits as the script has.
void edit(Json&, Script&);
void edit(Npz&, Script&);
void edit(plan::Plan&, Script&);
void edit(SurfaceMesh&, Script&);
void edit(TetMesh&, std::vector<int>& label, Script&);
std::string edited(const std::string& text, Script&);  // words and lines

// Edits of a scene as --set takes them: keys of the table of keys, values of their kind, mostly.
std::vector<std::string> scene_edits(const std::vector<std::string>& bodies, Script&);

}  // namespace limber::fuzz
