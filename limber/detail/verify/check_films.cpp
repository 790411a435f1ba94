#include "limber/detail/verify/check_films.h"

#include <optional>
#include <set>

#include "core/error.h"
#include "core/hash.h"
#include "core/progress.h"
#include "core/random.h"
#include "core/threads.h"
#include "limber/detail/body/work_folder.h"
#include "limber/detail/film/render.h"
#include "limber/detail/plan/manifest.h"
#include "render/film.h"
#include "render/png_file.h"

namespace limber::detail {

namespace {

// The options that a film's entry tells.
RenderOptions options_of(const fs::path& folder, const std::string& suffix, const RenderedFilm& entry) {
  RenderOptions options;
  options.folder = folder;
  options.camera = entry.camera;
  options.sets = entry.sets, options.passes = entry.passes, options.bits = entry.bits;
  options.size = fmt::format("{}x{}", entry.size[0], entry.size[1]);
  if (!suffix.empty() && suffix != "-" + options.camera) options.name = suffix.substr(1);
  for (const std::string& pass : options.passes)
    if (std::find(pass_names.begin(), pass_names.end(), pass) == pass_names.end())
      throw InputError(fmt::format("there is no pass \"{}\"", pass));
  if (options.bits != 8 && options.bits != 16)
    throw InputError(fmt::format("{} bits a channel: they are 8 or 16", options.bits));
  return options;
}

// What the entry says otherwise than the film `is`, or could not be; empty: nothing.
std::string false_word(const Json& entry, const RenderedFilm& told, RenderedFilm is) {
  if (told.failed < 0 || told.painted < 0 || told.painted + told.failed > told.wanted ||
      told.wanted > told.frames)
    return "it counts more frames than there are";
  if (told.film.has_value() != told.sheet.has_value()) return "a film has a contact sheet";
  if (told.film && told.failed > 0) return "no film is made where a frame failed";
  // What was done, and where.
  is.wanted = told.wanted, is.painted = told.painted, is.failed = told.failed, is.cpu_s = told.cpu_s;
  is.film = told.film, is.sheet = told.sheet;
  // A work folder may have been moved; what its frames are called may not.
  if (told.folder.filename() == is.folder.filename()) is.folder = told.folder;
  const Json all = json_of_fields(is);
  for (const auto& [key, value] : all.items())
    if (entry.at(key) != value)
      return fmt::format("{} is {}, and not {}", key, value.dump(), entry.at(key).dump());
  return entry.size() == all.size() ? "" : "it holds more than limber writes there";
}

// What a frame's file holds that limber did not write there; empty: nothing.
std::string odd_in(const fs::path& file) try {
  const auto info = render::inspect_png(file);
  if (!info) return "is damaged";
  for (const auto& [key, text] : info->texts)
    if (key != hash_of_frame && key != hash_of_pixels)
      return fmt::format("has a text \"{}\" that limber does not write", key);
  if (!info->texts.contains(hash_of_pixels))
    return "does not say what its pixels are; an older limber's did not: render it again";
  if (!info->texts.contains(hash_of_frame) ||
      info->texts.at(hash_of_pixels) !=
          hash_of_shown(info->texts.at(hash_of_frame), render::pixel_hash(file)))
    return "has other pixels than it says";
  return render::is_as_written(file)
             ? ""
             : "has other bytes than limber writes for these pixels (another zlib may write others)";
} catch (const InputError& error) {  // its pixels can't be had
  return fmt::format("is damaged ({})", error.what());
}

// The first file of these frames that is not as it was written, and what is odd in it; empty: none.
std::string first_odd(const Filming& filming, const std::vector<int>& frames) {
  std::vector<std::string> odd(frames.size());
  parallel_for(int(frames.size()), [&](int i) {
    throw_if_stopped();
    std::vector<std::string> passes = filming.output.passes;
    passes.insert(passes.begin(), "");
    for (const std::string& pass : passes) {
      const fs::path file = filming.files.of(frames[std::size_t(i)], pass);
      if (!fs::exists(file)) continue;  // of passes that are not told of, some frames may have none
      if (const std::string what = odd_in(file); odd[std::size_t(i)].empty() && !what.empty())
        odd[std::size_t(i)] = file.string() + " " + what;
    }
  });
  const auto first =
      std::find_if(odd.begin(), odd.end(), [](const std::string& what) { return !what.empty(); });
  return first == odd.end() ? "" : *first;
}

// One of each of so many equal parts of them; which, all pixels decide, so nobody knows before.
std::vector<int> picked(const Filming& filming, const std::vector<int>& frames, int count) {
  Hasher pixels;
  for (const int frame : frames) pixels.text(read_file(filming.files.of(frame)));
  Rng random(pixels.digest(), 0);
  std::vector<int> picks;
  const std::int64_t n = std::ssize(frames), parts = std::min<std::int64_t>(n, count);
  for (std::int64_t i = 0; i < parts; ++i) {
    const std::int64_t first = i * n / parts, end = (i + 1) * n / parts;
    picks.push_back(frames[std::size_t(first + random.below(int(end - first)))]);
  }
  return picks;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_picture(const fs::path& file) {
  static const std::set<std::string> endings{".png", ".jpg",  ".jpeg", ".webp", ".gif", ".bmp",
                                             ".tif", ".tiff", ".exr",  ".avif", ".heic"};
  return endings.contains(lower_case(file.extension().string()));
}

constexpr const char* film_endings[] = {".mp4", ".webm", ".gif"};

// A film named like this one that limber cannot have made; empty: none.
std::string stray_film(const fs::path& folder, const std::string& suffix) {
  static const std::set<std::string> endings{".mp4",  ".webm", ".gif", ".mov",  ".mkv",
                                             ".avi",  ".m4v",  ".ogv", ".ogg",  ".mpg",
                                             ".mpeg", ".wmv",  ".flv", ".apng", ".webp"};
  std::set<std::string> own, here;
  for (const char* ending : film_endings) own.insert("film" + suffix + ending);
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path& file = entry.path();
    const std::string stem = file.stem().string();  // names of cameras may differ by case alone
    if (lower_case(stem.substr(0, 4)) + stem.substr(std::min<std::size_t>(4, stem.size())) ==
            "film" + suffix &&
        endings.contains(lower_case(file.extension().string())) && !own.contains(file.filename().string()))
      here.insert(file.string());
  }
  return here.empty() ? "" : *here.begin();
}

// A picture or folder in the folder of frames that is named like none of this film; empty: none. Passes that
// an earlier render made of the same frames may lie there.
std::string stray_frame(const Filming& filming) {
  std::set<std::string> names, here;
  for (int f = 0; f < filming.shot->frames(); ++f) {
    names.insert(filming.files.of(f).filename().string());
    for (const std::string& pass : pass_names)
      if (const fs::path file = filming.files.of(f, pass);
          std::count(filming.output.passes.begin(), filming.output.passes.end(), pass) > 0 ||
          (fs::exists(file) && render::frame_hash(file) == filming.shot->hash_of(f)))
        names.insert(file.filename().string());
  }
  for (const auto& entry : fs::directory_iterator(filming.files.folder))
    if ((entry.is_directory() || is_picture(entry.path())) &&
        !names.contains(entry.path().filename().string()))
      here.insert(entry.path().string());
  return here.empty() ? "" : *here.begin();
}

// Which file of a frame, painted anew, is another; empty: none.
std::string other_picture(const Filming& filming, Shot::Painter& painter, int frame, const fs::path& again) {
  const Picture picture = painter.paint(frame);
  const auto differs = [&](const std::string& pass, const auto& any) {
    std::visit([&](const auto& image) { render::write_png(again, image); }, any);
    return render::read_png_16(again) != render::read_png_16(filming.files.of(frame, pass));
  };
  if (differs("", picture.frame)) return filming.files.of(frame).filename().string();
  for (const auto& [pass, image] : picture.passes)
    if (fs::exists(filming.files.of(frame, pass)) && differs(pass, image))
      return filming.files.of(frame, pass).filename().string();
  return "";
}

// What was written beside the frames' folder is here, wherever that was then, and so is what has such a name
// here: another folder's film is no word for this one's.
fs::path found(const fs::path& folder, const RenderedFilm& entry, const fs::path& told) {
  const fs::path here = folder / told.filename();
  return told.parent_path() == entry.folder.parent_path() || fs::exists(here) ? here : told;
}

constexpr std::string_view stage = "render";

// The film that is told of, and those of other endings that lie beside it: an earlier --video made them.
std::vector<fs::path> same_named(const fs::path& folder, const std::string& suffix, const fs::path& told) {
  std::vector<fs::path> films{told};
  for (const char* ending : film_endings)
    if (const fs::path film = folder / ("film" + suffix + ending);
        fs::exists(film) && film.filename() != told.filename())
      films.push_back(film);
  return films;
}

fs::path first_bad_file(const Filming& filming, int frame) {
  for (const std::string& pass : filming.output.passes)
    if (render::frame_hash(filming.files.of(frame)) == filming.shot->hash_of(frame) &&
        render::frame_hash(filming.files.of(frame, pass)) != filming.shot->hash_of(frame))
      return filming.files.of(frame, pass);
  return filming.files.of(frame);
}

// Passes that the entry does not tell of and that say that they show these frames: an earlier render of the
// same film was asked for them, and they are to be what they say, too.
std::vector<std::string> untold_passes(const Filming& filming) {
  std::vector<std::string> untold;
  for (const std::string& pass : pass_names) {
    const auto& told = filming.output.passes;
    if (std::find(told.begin(), told.end(), pass) != told.end()) continue;
    bool lies_there = false;
    for (int f = 0; f < filming.shot->frames() && !lies_there; ++f)
      if (const fs::path file = filming.files.of(f, pass); fs::exists(file))
        lies_there = render::frame_hash(file) == filming.shot->hash_of(f);
    if (lies_there) untold.push_back(pass);
  }
  return untold;
}

void check_film(const fs::path& folder, const std::string& suffix, const Json& written, int repaint,
                Promises& table) {
  const RenderedFilm entry = read_fields<RenderedFilm>(
      written, "manifest.json",
      "it does not tell what a film is made by; an older limber's did not: render it again");
  RenderOptions options = options_of(folder, suffix, entry);
  const Filming filming(options);
  const std::string name = "film" + suffix + ": ";
  const int count = filming.shot->frames();
  const bool is_whole = entry.film.has_value();
  std::vector<int> good, bad;
  for (int f = 0; f < count; ++f) {
    throw_if_stopped();
    if (filming.is_good(f))
      good.push_back(f);
    else if (is_whole || fs::exists(filming.files.of(f)))
      bad.push_back(f);
  }
  std::string wrong = false_word(written, entry, filming.told(options));
  if (wrong.empty() && !is_whole && entry.wanted - entry.failed > std::ssize(good))
    wrong = fmt::format("{} frames are told of, and {} are here", entry.wanted - entry.failed, good.size());
  table.row(name + "manifest.json tells of this film", wrong.empty(), wrong);
  table.row(name + "each frame says that it shows what it should", bad.empty() && !good.empty(),
            !bad.empty()
                ? fmt::format("{} do not; the first is {}; where all do not, another limber may have painted "
                              "them: render the film again",
                              bad.size(), first_bad_file(filming, bad[0]).string())
            : good.empty() ? fmt::format("no frame is there, of {}", count)
                           : fmt::format("{} of {} frames", good.size(), count));
  if (!bad.empty() || good.empty()) return;

  const std::vector<std::string> untold = untold_passes(filming);
  options.passes.insert(options.passes.end(), untold.begin(), untold.end());
  std::optional<Filming> with_untold;
  const Filming& seen = untold.empty() ? filming : with_untold.emplace(options);
  const std::string odd = first_odd(seen, good);
  table.row(name + "its frames' files are as limber wrote them", odd.empty(), odd);
  std::string stray = stray_frame(seen);
  if (stray.empty()) stray = stray_film(folder, suffix);
  table.row(name + "no other pictures lie among its frames", stray.empty(),
            stray.empty() ? "" : stray + " is none of this film's; remove it");
  const fs::path key = filming.files.folder / "passes.json";
  if (options.passes.empty() && fs::exists(key))
    table.row(name + "passes.json says what the passes hold", false,
              key.string() + ": there are none; remove it");
  if (!options.passes.empty()) {
    const bool same = fs::exists(key) && read_json(key) == Json::parse(seen.shot->key_of_passes().dump());
    table.row(name + "passes.json says what the passes hold", same,
              same ? "" : key.string() + " says otherwise, or is not there; render the passes again");
  }

  std::string other;
  const WorkFolder scratch("");
  Shot::Painter painter(*seen.shot);
  const std::vector<int> painted = picked(filming, good, repaint);
  for (const int frame : painted) {
    throw_if_stopped();
    if (other.empty()) other = other_picture(seen, painter, frame, scratch.path() / "again.png");
  }
  table.row(name + "frames that are painted again have the same pixels", other.empty(),
            other.empty() ? painted.size() < good.size() ? fmt::format("{} of {}: {}", painted.size(),
                                                                       good.size(), fmt::join(painted, ", "))
                                                         : fmt::format("all {}", good.size())
                          : other + " has others (another OSMesa may paint otherwise)");
  if (!is_whole) return;

  const fs::path told = found(folder, entry, *entry.film);
  for (const fs::path& film : same_named(folder, suffix, told)) {
    const fs::path again = scratch.path() / ("again" + film.extension().string());
    render::make_film(filming.paths(), filming.planned.scene.film.frames_per_second, again);
    const bool film_is = fs::exists(film) && read_file(film) == read_file(again);
    table.row(name + "made again from its frames: the same bytes", film_is,
              film_is ? film.string()
                      : film.string() + " has others, or is not there (another ffmpeg makes others)");
  }
  if (!entry.sheet) return;  // a false word of manifest.json, which is told
  const fs::path sheet = found(folder, entry, *entry.sheet);
  const bool sheet_is = fs::exists(sheet) && render::read_png(sheet) == filming.sheet();
  table.row(name + "contact sheet made again from its frames: the same pixels", sheet_is, sheet.string());
}

// A film, contact sheet or folder of frames, by its name, that no entry tells of; empty: none.
std::string film_of_nobody(const fs::path& folder, const Json& manifest) {
  std::set<std::string> told, here;
  for (const auto& [key, entry] : manifest.items())
    for (const char* file : {"film", "sheet", "folder"})
      if (entry.is_object() && entry.contains(file) && entry.at(file).is_string())
        told.insert(fs::path(entry.at(file).get<std::string>()).filename().string());
  for (const auto& [key, entry] : manifest.items())  // same_named has looked at these
    if (key.starts_with(stage) && entry.is_object() && entry.contains("film"))
      for (const char* ending : film_endings) told.insert("film" + key.substr(stage.size()) + ending);
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string(), ending = entry.path().extension().string();
    const auto is_called = [&](const char* name) {
      return stem == name || stem.starts_with(std::string(name) + "-");
    };
    const bool moves =
        std::find(std::begin(film_endings), std::end(film_endings), ending) != std::end(film_endings);
    if ((moves && is_called("film")) || (ending == ".png" && is_called("sheet")) ||
        (entry.is_directory() && is_called("frames")))
      here.insert(entry.path().filename().string());
  }
  for (const std::string& name : here)
    if (!told.contains(name)) return name;
  return "";
}

}  // namespace

void check_films(const fs::path& folder, int repaint, Promises& table) {
  const Json manifest = read_manifest(folder);
  int films = 0;
  for (const auto& [key, entry] : manifest.items()) {
    if (key != stage && !key.starts_with(std::string(stage) + "-")) continue;
    ++films;
    const std::string suffix = key.substr(stage.size());
    try {
      check_film(folder, suffix, entry, repaint, table);
    } catch (const InputError& error) {
      table.row("film" + suffix + ": manifest.json tells of this film", false, error.what());
    }
  }
  if (const std::string odd = film_of_nobody(folder, manifest); films > 0 && !odd.empty())
    table.row("films: manifest.json tells of each", false,
              odd + " is of no film that limber made here and tells of; render it to its end, or remove it");
  if (films == 0 && !film_of_nobody(folder, manifest).empty())
    table.row("films: manifest.json tells of each", false,
              film_of_nobody(folder, manifest) + " is here, and manifest.json tells of no film");
  else if (films == 0)
    throw InputError(
        fmt::format("{}: manifest.json tells of no film; make one with limber render", folder.string()));
}

}  // namespace limber::detail
