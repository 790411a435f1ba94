#include "tests/fuzz/edits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/words.h"
#include "scenes/detail/schema.h"

namespace limber::fuzz {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::array odd_numbers{0.0,
                                 -0.0,
                                 1.0,
                                 -1.0,
                                 2.0,
                                 0.5,
                                 -7.0,
                                 1e-3,
                                 1e-9,
                                 1e-300,
                                 1e9,
                                 1e30,
                                 1e300,
                                 -1e9,
                                 3.0,
                                 100.0,
                                 255.0,
                                 256.0,
                                 65536.,
                                 5e-5,
                                 0x1p31 - 1,
                                 0x1p31,
                                 -0x1p31,
                                 0x1p32,
                                 0x1p53,
                                 0x1p62,
                                 infinity,
                                 -infinity,
                                 std::numeric_limits<double>::quiet_NaN()};

template <class Whole>
Whole cut_to(double x) {
  constexpr double least = double(std::numeric_limits<Whole>::min()),
                   most = double(std::numeric_limits<Whole>::max());
  if (!(x > least)) return std::numeric_limits<Whole>::min();  // nan, too
  return x >= most ? std::numeric_limits<Whole>::max() : Whole(x);
}

}  // namespace

std::string_view Script::rest(int bytes) {
  const std::string_view taken = bytes_.substr(0, std::size_t(bytes));
  bytes_.remove_prefix(taken.size());
  return taken;
}

int Script::below(int n) {
  unsigned value = 0;
  for (const char c : rest(n > 256 ? 2 : 1)) value = 256 * value + static_cast<unsigned char>(c);
  return int(value % unsigned(n));
}

double Script::number(double now) {
  switch (below(8)) {
    case 0:
      return odd_numbers[std::size_t(below(int(odd_numbers.size())))];
    case 1:
      return now + below(9) - 4;
    case 2:
      return -now;
    case 3:
      return now * std::ldexp(1.0, below(129) - 64);
    case 4:
      return std::nextafter(now, below(2) == 0 ? -infinity : infinity);
    case 5:
      return now * (1 + 1e-3 * (below(256) - 128));
    case 6:
      return below(1000);
    default: {
      double any = 0;
      const std::string_view bits = rest(sizeof any);
      std::memcpy(&any, bits.data(), bits.size());
      return any;
    }
  }
}

std::int64_t Script::whole(std::int64_t now) { return cut_to<std::int64_t>(number(double(now))); }
std::int32_t Script::whole(std::int32_t now) { return cut_to<std::int32_t>(number(double(now))); }

std::string Script::word() {
  static const std::vector<std::string> words{
      "",    "x",    "0",    "-1",        "nan", "inf", "1e999", "\"", "\n",  "[",
      "{",   "true", "null", "/dev/null", "..",  "%s",  "\xff",  "#",  "a/b", "0x1p3",
      "+ z", "-z",   "v",    "f",         "g",   "$",   "1e",    ".",  "a.b", "99999999999999999999"};
  const int which = below(int(words.size()) + 2);
  if (which == int(words.size())) return std::string(5000, 'a');
  return which > int(words.size()) ? std::string(rest(below(16))) : words[std::size_t(which)];
}

namespace {

void collect(Json& node, std::vector<Json*>& all) {
  all.push_back(&node);
  if (node.is_structured())
    for (Json& child : node) collect(child, all);
}

// What a JSON file can hold.
std::string json_word(Script& script) {
  const std::string word = script.word();
  return is_utf8(word) ? word : "?";
}

void edit_once(Json& root, Script& script) {
  std::vector<Json*> all;
  collect(root, all);
  Json& node = *all[std::size_t(script.below(int(all.size())))];
  switch (script.below(10)) {
    case 0:
      node = json_word(script);
      break;
    case 1:
      node = Json::array();
      break;
    case 2:
      node = Json::object();
      break;
    case 3:
      node = nullptr;
      break;
    case 4:
      node = script.below(2) == 0;
      break;
    case 5:
      if (all.size() < 500)  // a copy of all within itself doubles it
        if (Json copy = *all[std::size_t(script.below(int(all.size())))]; true) node = std::move(copy);
      break;
    case 6:
      if (node.is_structured() && !node.empty())
        node.erase(std::next(node.begin(), script.below(int(node.size()))));
      break;
    case 7:
      if (node.is_object()) node[json_word(script)] = script.below(100);
      if (node.is_array()) node.push_back(node.empty() ? Json(1) : Json(node[0]));
      break;
    default:
      if (node.is_number_integer())
        node = script.whole(node.get<std::int64_t>());
      else if (node.is_number())
        node = script.number(node.get<double>());
      else if (node.is_boolean())
        node = !node.get<bool>();
      else
        node = script.number(1.0);
  }
}

template <class T>
void change_element(NpyArray& array, std::size_t at, Script& script) {
  T value;
  std::byte* const place = array.bytes.data() + at * sizeof value;
  std::memcpy(&value, place, sizeof value);
  if constexpr (std::is_floating_point_v<T>)
    value = T(script.number(double(value)));
  else
    value = cut_to<T>(script.number(double(value)));
  std::memcpy(place, &value, sizeof value);
}

// Its bytes stay as many as shape and type say: what does not fit is no array, and told by its hash alone.
void edit_once(NpyArray& array, Script& script) {
  const std::size_t size = std::size_t(array.size());
  const int action = script.below(8);
  if (action == 0) {
    static const std::vector<std::string> types{"<f4", "<f8", "<i2", "<i4", "<i8", "<u8", "|u1"};
    const std::string& type = types[std::size_t(script.below(int(types.size())))];
    array.dtype = type;
    array.bytes.resize(size * std::size_t(type[2] - '0'));
    return;
  }
  if (array.shape.empty() || size == 0) return;
  const std::size_t width = array.bytes.size() / size, row = array.bytes.size() / std::size_t(array.shape[0]);
  if (action == 1) {  // a row more, or fewer
    const bool more = script.below(2) == 0;
    array.shape[0] += more ? 1 : -1;
    array.bytes.resize(std::size_t(array.shape[0]) * row);
    if (more && array.shape[0] > 1)
      std::copy_n(array.bytes.end() - std::ptrdiff_t(2 * row), row, array.bytes.end() - std::ptrdiff_t(row));
  } else if (action == 2) {  // the same in another shape
    if (script.below(2) == 0)
      array.shape = {std::int64_t(size)};
    else
      std::reverse(array.shape.begin(), array.shape.end());
  } else if (action == 3) {
    const std::size_t from = std::size_t(script.below(int(size))), to = std::size_t(script.below(int(size)));
    std::memmove(array.bytes.data() + to * width, array.bytes.data() + from * width, width);
  } else {
    const std::size_t at = std::size_t(script.below(int(size)));
    if (array.dtype == "<f4") change_element<float>(array, at, script);
    if (array.dtype == "<f8") change_element<double>(array, at, script);
    if (array.dtype == "<i2") change_element<std::int16_t>(array, at, script);
    if (array.dtype == "<i4") change_element<std::int32_t>(array, at, script);
    if (array.dtype == "<i8") change_element<std::int64_t>(array, at, script);
  }
}

void edit_once(Npz& file, Script& script) {
  const int entries = int(file.arrays.size());
  const int action = script.below(8);
  if (action < 2 && file.texts.contains("meta.json")) {
    Json meta = Json::parse(file.texts.at("meta.json"));
    edit_once(meta, script);
    file.texts.at("meta.json") = meta.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  if (entries == 0) return;
  const auto array = std::next(file.arrays.begin(), script.below(entries));
  if (action == 2) {
    const auto other = std::next(file.arrays.begin(), script.below(entries));
    if (script.below(4) == 0)
      file.arrays.erase(array);
    else
      array->second = NpyArray(other->second);
  } else {
    edit_once(array->second, script);
  }
}

void edit_once(Control& control, Script& script) {
  switch (script.below(6)) {
    case 0:
      control.manipulation = Manipulation(script.below(7) - 1);
      break;
    case 1:
      control.force_n[script.below(3)] = script.number(control.force_n.x());
      break;
    case 2:
      control.node = script.whole(control.node);
      break;
    case 3:
      control.radius_m = script.number(control.radius_m);
      break;
    case 4:
      control.target_m[script.below(3)] = script.number(control.target_m.x());
      control.max_force_n = script.number(control.max_force_n);
      break;
    default:
      control.steps = script.whole(control.steps);
  }
}

void edit_once(State& state, Script& script) {
  if (script.below(4) == 0) state.step = script.whole(state.step);
  std::vector<float>& numbers = script.below(2) == 0 ? state.positions : state.velocities;
  if (numbers.empty()) return;
  float& number = numbers[std::size_t(script.below(int(numbers.size())))];
  number = script.number(number);
}

template <class T>
T* one_of(std::vector<T>& list, Script& script) {
  return list.empty() ? nullptr : &list[std::size_t(script.below(int(list.size())))];
}

void edit_states(plan::Tree& tree, Script& script) {
  const std::size_t changed = std::size_t(script.below(std::max(1, tree.size())));
  plan::States states;
  for (std::size_t i = 0; i < std::size_t(tree.states.size()); ++i) {
    State state = tree.states[i];
    if (i == changed) edit_once(state, script);
    states.push_back(state, i == 0 ? -1 : int(i) - 1);
  }
  tree.states = std::move(states);
}

void edit_once(plan::Plan& plan, Script& script) {
  plan::Trajectory& path = plan.trajectory;
  switch (script.below(16)) {
    case 0: {
      Json settings = json_of(plan.settings);
      edit_once(settings, script);
      plan.settings = plan::settings_from_json(settings, "settings");
      break;
    }
    case 1: {
      plan::Statistics& s = plan.statistics;
      std::array counts{&s.iterations,    &s.diverged, &s.rejected,      &s.refused,
                        &s.rollout_steps, &s.rollouts, &s.rollouts_wrong};
      std::int64_t& count = *counts[std::size_t(script.below(int(counts.size())))];
      count = script.whole(count);
      break;
    }
    case 2:
      plan.statistics.cpu_s = script.number(plan.statistics.cpu_s);
      break;
    case 3:
      if (Control* control = one_of(path.controls, script)) edit_once(*control, script);
      break;
    case 4:
      if (Control* control = one_of(plan.tree.controls, script)) edit_once(*control, script);
      break;
    case 5:
      if (State* frame = one_of(path.frames, script)) edit_once(*frame, script);
      break;
    case 6:
      edit_once(path.end, script);
      break;
    case 7:
      if (const int node = script.below(std::max(1, plan.tree.size())); node > 0)
        plan.tree.parents[std::size_t(node)] = script.below(node);
      break;
    case 8:
      if (std::int64_t* iteration = one_of(plan.tree.iterations, script))
        *iteration = script.whole(*iteration);
      break;
    case 9:
      plan.best_node = plan.goal_node = script.below(std::max(1, plan.tree.size() + 1)) - 1;
      plan.best_node = std::clamp(plan.best_node, 0, plan.tree.size() - 1);
      break;
    case 10:
      plan.ending = plan::Ending(script.below(4));
      plan.best_distance_m = script.number(plan.best_distance_m);
      break;
    case 11:
      path.settle_steps = script.whole(path.settle_steps);
      path.frames_per_second = plan.settings.frames_per_second =
          script.number(plan.settings.frames_per_second);
      break;
    case 12:
      if (path.frames.size() > 1)
        path.frames.erase(path.frames.begin() + script.below(int(path.frames.size())));
      if (path.controls.size() > 1 && script.below(2) == 0) path.controls.pop_back();
      break;
    case 13:
      if (plan::Leg* leg = one_of(plan.legs, script)) {
        leg->root = script.below(plan.tree.size() + 1);
        leg->first_iteration = script.whole(leg->first_iteration);
      }
      break;
    case 14:
      if (script.below(2) == 0 && !plan.legs.empty())
        plan.legs.pop_back();
      else
        plan.settings.via.push_back({plan.settings.goal, script.below(2) == 0});
      break;
    default:
      edit_states(plan.tree, script);
  }
}

// A triangle or tet names the rows of the positions; what would name none goes elsewhere.
template <class Rows>
void edit_rows(Points& positions, Rows& rows, Script& script) {
  if (positions.rows() == 0 || rows.rows() == 0) return;
  const auto row = script.below(int(rows.rows())), column = script.below(int(rows.cols()));
  switch (script.below(4)) {
    case 0:
      rows(row, column) = script.whole(rows(row, column));
      break;
    case 1:
      rows.row(row) = rows.row(script.below(int(rows.rows()))).eval();
      break;
    default: {
      double& x = positions(script.below(int(positions.rows())), script.below(3));
      x = script.number(x);
    }
  }
}

}  // namespace

void edit(Json& json, Script& script) {
  while (script.more()) edit_once(json, script);
}
void edit(Npz& file, Script& script) {
  while (script.more()) edit_once(file, script);
}
void edit(plan::Plan& plan, Script& script) {
  while (script.more()) edit_once(plan, script);
}
void edit(SurfaceMesh& mesh, Script& script) { edit_rows(mesh.positions, mesh.triangles, script); }
void edit(TetMesh& mesh, std::vector<int>& label, Script& script) {
  if (script.below(4) == 0)
    *one_of(label, script) = script.whole(label.front());
  else
    edit_rows(mesh.positions, mesh.tets, script);
}

std::string edited(const std::string& text, Script& script) {
  std::vector<std::string> words;  // and the white space between them
  for (const char c : text) {
    const bool space = c == ' ' || c == '\n';
    if (words.empty() || space || words.back() == " " || words.back() == "\n") words.emplace_back();
    words.back() += c;
  }
  while (script.more() && !words.empty()) {
    const std::size_t at = std::size_t(script.below(int(words.size())));
    switch (script.below(6)) {
      case 0:
        words[at] = script.word();
        break;
      case 1:
        words.erase(words.begin() + std::ptrdiff_t(at));
        break;
      case 2:
        words[at] = words[std::size_t(script.below(int(words.size())))];
        break;
      case 3:
        words.insert(words.begin() + std::ptrdiff_t(at), words[std::size_t(script.below(int(words.size())))]);
        break;
      default:
        words[at] = fmt::format("{}", script.number(std::strtod(words[at].c_str(), nullptr)));
    }
  }
  std::string together;
  for (const std::string& word : words) together += word;
  return together;
}

namespace {

std::string list_of(const std::vector<double>& numbers) {
  std::string text = "[";
  for (const double x : numbers) text += fmt::format("{}{}", text.size() > 1 ? ", " : "", x);
  return text + "]";
}

// Mostly in the key's range, which most of a scene's numbers must be before any is looked at.
double number_for(const scenes::Key& key, Script& script) {
  const double low = std::max(key.interval.lower, -10.0), high = std::min(key.interval.upper, 10.0);
  if (script.below(4) == 0) return script.number(1.0);
  const double share = script.below(1001) / 1000.0;
  const double x = low + share * (std::max(low, high) - low);
  return key.type == scenes::Type::integer || key.type == scenes::Type::integers ? std::round(x) : x;
}

std::string box_for(const scenes::Key& key, Script& script) {
  std::vector<double> lower, upper;
  for (int i = 0; i < 3; ++i) {
    lower.push_back(number_for(key, script)), upper.push_back(number_for(key, script));
    if (lower.back() > upper.back() && script.below(16) != 0) std::swap(lower.back(), upper.back());
  }
  return fmt::format("[{}, {}]", list_of(lower), list_of(upper));
}

std::string value_for(const scenes::Key& key, const std::vector<std::string>& bodies, Script& script) {
  using scenes::Type;
  const auto numbers = [&](int count) {
    std::vector<double> all;
    for (int i = 0; i < count; ++i) all.push_back(number_for(key, script));
    return list_of(all);
  };
  switch (key.type) {
    case Type::number:
    case Type::integer:
      return fmt::format("{}", number_for(key, script));
    case Type::vector:
    case Type::integers:
      return numbers(key.count);
    case Type::range:
      return numbers(2);
    case Type::box:
    case Type::region:
      return box_for(key, script);
    case Type::boxes:
      return fmt::format("[{}, {}]", box_for(key, script), box_for(key, script));
    case Type::points:
      return fmt::format("[{}, {}, {}]", numbers(3), numbers(3), numbers(3));
    case Type::boolean:
      return script.below(2) == 0 ? "true" : "false";
    case Type::color:
      return script.below(4) == 0 ? script.word() : "\"#102030\"";
    case Type::fixed:
      return script.below(2) == 0 ? "walls" : fmt::format("[{{ box_m = {} }}]", box_for(key, script));
    case Type::names:
    case Type::bodies:
    case Type::labels: {
      const std::string& body = bodies[std::size_t(script.below(int(bodies.size())))];
      if (key.type != Type::labels || script.below(3) == 0) return fmt::format("[\"{}\"]", body);
      return script.below(2) == 0 ? "true" : fmt::format("{{ {} = \"{}\" }}", body, script.word());
    }
    case Type::choice: {
      std::vector<std::string> choices{""};
      for (const char c : key.choices)
        if (c == ',')
          choices.emplace_back();
        else if (c != ' ')
          choices.back() += c;
      return choices[std::size_t(script.below(int(choices.size())))];
    }
    case Type::text:
    case Type::name:
      return script.below(2) == 0 ? script.word() : bodies[std::size_t(script.below(int(bodies.size())))];
    case Type::table:
      return "{}";
    case Type::tables:
      return script.below(2) == 0 ? "[]" : "[{}]";
  }
  return "";
}

}  // namespace

std::vector<std::string> scene_edits(const std::vector<std::string>& bodies, Script& script) {
  std::vector<std::string> sets;
  const auto all = scenes::keys();
  while (script.more() && sets.size() < 16) {
    const scenes::Key& key = all[std::size_t(script.below(int(all.size())))];
    std::string path(key.path);
    if (const auto list = path.find("[]"); list != path.npos)
      path.replace(
          list, 2,
          path.starts_with("bodies") ? "." + bodies[std::size_t(script.below(int(bodies.size())))] : ".0");
    for (std::size_t list; (list = path.find("[]")) != path.npos;) path.replace(list, 2, ".0");
    sets.push_back(path + "=" + (script.below(16) == 0 ? script.word() : value_for(key, bodies, script)));
  }
  return sets;
}

}  // namespace limber::fuzz
