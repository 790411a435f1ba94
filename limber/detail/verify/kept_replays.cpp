#include "limber/detail/verify/kept_replays.h"

#include <algorithm>
#include <regex>
#include <set>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json_fields.h"
#include "core/json_text.h"
#include "core/log.h"

namespace limber::detail {

namespace {

struct KeptFate : Fate {
  template <class Fields>
  void fields(Fields& f) {
    f("world", world), f("reaches", reaches), f("end", end), f("distance_m", distance_m);
    f("speed_m_s", speed_m_s), f("duration_s", duration_s), f("end_center_m", end_center_m);
    f("volume_change", volume_change), f("penetration_m", penetration_m), f("min_stretch", min_stretch);
    f("largest_stretch", largest_stretch), f("overlap_m", overlap_m), f("self_overlap_m", self_overlap_m);
    f("asked_n", asked_n), f("force_n", force_n), f("broken", broken), f("searches", searches);
  }
};

struct KeptLine {
  std::string by;
  double look_s = 0;  // where it is planned anew: between looks
  int world = 0;
  std::vector<KeptFate> fates;
  std::string hash = "";  // of the line without it, so that none is taken that was changed
  template <class Fields>
  void fields(Fields& f) {
    f("by", by), f.unless_usual("look_s", look_s, 0.0), f("world", world), f("fates", fates);
    f.unless_usual("hash", hash, std::string());
  }
  std::string hash_of_content() const {
    KeptLine content = *this;
    content.hash.clear();
    return hex(hash_of(std::string_view(text_of(json_of_fields(content)))));
  }
};

// Those that are whole.
std::vector<KeptLine> lines_in(const JsonLines& file) {
  std::vector<KeptLine> lines;
  for (const Json& json : file.read())
    if (auto line = fields_or_nothing<KeptLine>(json); line && line->hash == line->hash_of_content())
      lines.push_back(*std::move(line));
  return lines;
}

std::string first_of(const std::string& hash) { return hash.substr(0, 8); }

std::string key_of(const PlanFolder& planned) {
  return first_of(content_hash(fmt::format("{} {}", program_hash(), hex(planned.file_hash))));
}

std::string key_of(const RobustOptions& o) {
  return first_of(content_hash(fmt::format("{} {} {} {} {} {}", o.perturbations, o.seed, o.material_share,
                                           o.force_share, o.force_deg, std::min(o.perturbations, o.worlds))));
}

}  // namespace

const char* words_for(By by) {
  constexpr const char* words[] = {"open loop", "followed", "planned anew"};
  return words[int(by)];
}

KeptReplays::KeptReplays(const PlanFolder& planned, const RobustOptions& options)
    : look_s_(options.replan_s),
      file_(options.folder / "robust" / fmt::format("{}-{}.jsonl", key_of(planned), key_of(options))),
      lines_(file_) {
  static const std::regex own("([0-9a-f]{8})-[0-9a-f]{8}\\.jsonl");
  std::vector<fs::path> others;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(file_.parent_path(), none)) {
    const std::string name = entry.path().filename().string();
    std::smatch parts;
    if (std::regex_match(name, parts, own) && parts[1] != key_of(planned)) others.push_back(entry.path());
  }
  for (const fs::path& file : others) fs::remove(file, none);
}

void KeptReplays::look_up(std::vector<Replays>& all) const {
  std::error_code none;
  if (!fs::is_regular_file(file_, none)) return;  // whoever is to write it says what is wrong
  for (const KeptLine& line : lines_in(lines_))
    for (Replays& part : all)
      if (line.world == part.world && line.by == words_for(part.by) &&
          (part.by != By::replanning || line.look_s == look_s_) &&
          int(line.fates.size()) == part.last - part.first)
        part.fates.assign(line.fates.begin(), line.fates.end());
}

Json KeptReplays::line_of(const Replays& part) const {
  KeptLine line{words_for(part.by), part.by == By::replanning ? look_s_ : 0, part.world, {}};
  for (const Fate& fate : part.fates) line.fates.push_back({fate});
  line.hash = line.hash_of_content();
  return json_of_fields(line);
}

void KeptReplays::add(const Replays& part) {
  const std::lock_guard lock(mutex_);
  if (!keeps_) return;
  try {
    make_folder(file_.parent_path());
    lines_.append(line_of(part));
  } catch (const std::exception& error) {
    tell_not_kept(error);
  }
}

void KeptReplays::put_in_order(const std::vector<Replays>& all) {
  if (!keeps_) return;
  try {
    std::set<std::string> others;  // of other ways
    for (const KeptLine& line : lines_in(lines_)) others.insert(text_of(json_of_fields(line)) + "\n");
    std::string text;
    for (const Replays& part : all) {
      const std::string line = text_of(line_of(part)) + "\n";
      text += line, others.erase(line);
    }
    for (const std::string& line : others) text += line;
    if (read_file(file_) != text) write_file(file_, text);
  } catch (const std::exception& error) {
    tell_not_kept(error);
  }
}

void KeptReplays::tell_not_kept(const std::exception& error) {
  keeps_ = false;
  log::warn("what is replayed is not kept: {}", error.what());
}

}  // namespace limber::detail
