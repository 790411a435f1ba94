#include "limber/detail/batch/prepare_many.h"

#include <fmt/ranges.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <memory>
#include <set>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/events.h"
#include "core/json_text.h"
#include "core/lock.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/temporary_files.h"
#include "core/threads.h"
#include "limber/detail/batch/limited_process.h"
#include "limber/detail/body/preview.h"
#include "limber/exit_codes.h"

namespace limber::detail {

namespace {

constexpr double clock_over_cpu = 5;  // a busy machine gives a process less than all of a core
constexpr int between_looks_us = 2000;
constexpr double patience_s = 0.5;  // with those that are told to stop

enum class Outcome { made, in_store, up_to_date, failed, failed_before };

struct Work {
  BatchModel result;
  std::string body_key;
  Json identity;  // of its source
  std::uintmax_t bytes = 0;
  Outcome found = Outcome::made;
  bool pending = false;
};

// What starting it costs beside what its size does: a guess, for the estimate of what is left.
double weight_of(const Work& work) { return 1 + double(work.bytes) / 2e6; }

std::string text_of_number(double value) { return fmt::format("{}", value); }

// By limber prepare --json: what went wrong, or the body's report.
struct SaidByPrepare {
  std::optional<std::string> error;
  std::optional<BodyInput> input;
  std::optional<InOrder<double>> cpu_seconds;
  std::vector<std::string> also_written;
  template <class Fields>
  void fields(Fields& f) {
    f("error", error), f("input", input), f("cpu_seconds", cpu_seconds);
    f.if_there("also_written", also_written);
  }
};

class Batch {
 public:
  // `part`: of a batch; empty: all of it.
  explicit Batch(const BatchOptions& options, std::string part = "")
      : options_(options),
        out_(options.each.out),
        part_(std::move(part)),
        jobs_(options.jobs > 0 ? options.jobs : thread_count()) {
    const double memory_mb = options.memory_mb > 0 ? options.memory_mb : memory_share_mb(jobs_);
    limits_ = {options.time_limit_s, clock_over_cpu * options.time_limit_s, memory_mb};
    store_folder_ = options.each.store.empty() ? out_ / "store" : options.each.store;
  }

  PreparedMany run() {
    require_agreeing(options_.each);
    const std::vector<ListedModel> listed =
        options_.listed.empty() ? list_models(options_.models, {out_, store_folder_}) : options_.listed;
    make_folder(out_);
    const FolderLock lock(out_, FolderLock::alone);
    for (const ListedModel& model : listed) work_.emplace_back().result.model = model;
    try {
      make_bodies();
    } catch (const Interrupted&) {
      log::info("{}: what is prepared is kept; the same command goes on", out_.string());
      throw;
    }
    return finish();
  }

  PreparedMany run_part(const std::vector<std::size_t>& which) {
    const FolderLock lock(out_, FolderLock::shared, FolderLock::waits);
    for (const std::size_t model : which) work_.emplace_back().result.model = options_.listed.at(model);
    make_bodies();
    return counts();
  }

 private:
  void make_bodies() {
    for (const char* part : {"bodies", "failed"}) make_folder(out_ / part);
    store_ = std::make_unique<BodyStore>(store_folder_);
    journal_ = std::make_unique<Journal>(out_, part_);
    look_at_all();
    make_missing();
  }

  // What is there already, here or in the store, and what need not be tried again.
  void look_at_all() {
    parallel_for(int(work_.size()), [&](int i) {
      throw_if_stopped();
      look_at(work_[std::size_t(i)]);
    });
  }

  void look_at(Work& work) {
    const fs::path& file = work.result.model.file;
    const ModelOptions& each = options_.each;
    Json input;
    try {
      ModelOptions one = each;
      one.model = file;
      const BodySource source = source_of(one, file);
      input = input_of(source.identity, settings_of(each));
      work.body_key = BodyStore::key_of(source, input);
      work.identity = source.identity;
      std::error_code none;
      work.bytes = fs::file_size(file, none);
    } catch (const InputError& error) {
      fail(work, "refused", error.what(), Outcome::failed);
      return;
    }
    Json more{{"body", work.body_key}};
    if (asks_for_more())
      more.update({{"source", file.string()},  // which they name
                   {"exports", each.exports},
                   {"density_kg_m3", each.density_kg_m3},
                   {"preview", each.preview}});
    work.result.key = content_hash(text_of(more));

    const Attempt* said = journal_->find(work.result.model.name);
    if (said && said->key != work.result.key) said = nullptr;
    if (said && would_fail_again(*said)) {
      fail(work, said->reason, said->message, Outcome::failed_before);
      return;
    }
    const fs::path folder = folder_of(out_, work.result);
    if (is_there(folder, input, file, said)) {
      remove_abandoned(folder);
      store_->keep(work.body_key, folder);
      work.found = Outcome::up_to_date;
    } else if (!asks_for_more() && fetch(work, input, folder)) {
      work.found = Outcome::in_store;
    } else {
      work.pending = true;
    }
  }

  bool asks_for_more() const { return !options_.each.exports.empty() || options_.each.preview; }

  // A limit that was raised may let it through; what else it ended by, it would end by again.
  bool would_fail_again(const Attempt& said) const {
    if (said.reason.empty() || options_.retry_failed) return false;
    if (said.reason == "time") return limits_.cpu_s <= said.time_limit_s;
    if (said.reason == "memory") return limits_.memory_mb <= said.memory_mb;
    return true;
  }

  bool is_there(const fs::path& folder, const Json& input, const fs::path& file, const Attempt* said) const {
    const std::optional<BodyReport> report = up_to_date_report(folder, input);
    if (!report || !has_picture(folder)) return false;
    // Another file may hold the same bytes, and lend its body another name.
    if (Json(report->model) != Json::parse(text_of(Json(file.string())))) return false;
    if (!asks_for_more()) return true;
    if (!said) return false;
    return std::all_of(said->also_written.begin(), said->also_written.end(),
                       [&](const std::string& also) { return fs::exists(folder / also); });
  }

  bool fetch(Work& work, const Json& input, const fs::path& folder) {
    if (!store_->has(work.body_key) || !store_->has_picture(work.body_key)) return false;
    make_folder(folder);
    remove_abandoned(folder);
    return store_->fetch(work.body_key, input, work.result.model.file.string(), folder).has_value();
  }

  void fail(Work& work, const std::string& reason, const std::string& message, Outcome found) {
    work.result.reason = reason, work.result.message = message;
    work.found = found, work.pending = false;
  }

  struct Running {
    Work* work;
    std::unique_ptr<LimitedProcess> process;
  };

  void make_missing() {
    std::vector<Work*> order;
    for (Work& work : work_)
      if (work.pending) order.push_back(&work);
    // What takes long is not left for the end, where all would wait for it.
    std::stable_sort(order.begin(), order.end(),
                     [](const Work* a, const Work* b) { return a->bytes > b->bytes; });
    double all = 0, done = 0;
    for (const Work* work : order) all += weight_of(*work);
    std::deque<Work*> waiting(order.begin(), order.end());
    std::vector<Running> running;
    Progress progress("prepare", std::int64_t(order.size()));
    std::int64_t ended = 0;
    int failed = 0;
    while (!waiting.empty() || !running.empty()) {
      if (stop_signal()) {
        stop(running);
        throw_if_stopped();
      }
      while (int(running.size()) < jobs_ && !waiting.empty()) {
        Work* const next = take_next(waiting, running);
        if (!next) break;
        running.push_back({next, start(*next)});
      }
      ::usleep(between_looks_us);
      for (std::size_t r = 0; r < running.size();) {
        const std::optional<EndedProcess> end = running[r].process->ended();
        if (!end) {
          ++r;
          continue;
        }
        Work& work = *running[r].work;
        running.erase(running.begin() + std::ptrdiff_t(r));
        settle(work, *end);
        done += weight_of(work), ++ended;
        failed += work.found == Outcome::failed;
        events::tell({{"event", "model"},
                      {"name", work.result.model.name},
                      {"reason", work.result.reason},
                      {"seconds", end->clock_s},
                      {"done", ended},
                      {"total", order.size()}});
      }
      progress.update(ended, failed ? fmt::format("{} failed", failed) : "", all > 0 ? done / all : 1);
    }
  }

  // The first whose body nobody else is making; its twin finds that in the store.
  static Work* take_next(std::deque<Work*>& waiting, const std::vector<Running>& running) {
    const auto is_made = [&](const Work* work) {
      return std::any_of(running.begin(), running.end(),
                         [&](const Running& other) { return other.work->body_key == work->body_key; });
    };
    const auto next = std::find_if_not(waiting.begin(), waiting.end(), is_made);
    if (next == waiting.end()) return nullptr;
    Work* const work = *next;
    waiting.erase(next);
    return work;
  }

  std::vector<std::string> words_for(const Work& work, const std::string& folder) const {
    const ModelOptions& o = options_.each;
    std::string model = work.result.model.file.string();
    if (model.starts_with('-') || model.starts_with('@')) model = "./" + model;
    std::vector<std::string> words{"prepare", model, "-o", folder};
    const auto add = [&](std::initializer_list<std::string> more) {
      words.insert(words.end(), more.begin(), more.end());
    };
    add({"--shells", std::to_string(o.shells), "--concavity", text_of_number(o.concavity), "--inflate",
         text_of_number(o.inflate), "--tets", std::to_string(o.tets), "--mode", o.mode, "--scale",
         text_of_number(o.scale), "--density", text_of_number(o.density_kg_m3), "--shell-corners",
         std::to_string(o.max_hull_vertices)});
    if (o.threshold > 0) add({"--threshold", text_of_number(o.threshold)});
    if (!o.label.empty())
      add({"--label", o.label, "--label-gap", text_of_number(o.label_gap), "--label-smoothing",
           std::to_string(o.label_rounds), "--least-island", text_of_number(o.min_island)});
    if (o.exact) add({"--exact"});
    if (o.y_up) add({"--y-up"});
    if (!o.only.empty()) add({"--only", o.only});
    if (o.preview) add({"--preview"});
    if (!o.exports.empty()) add({"--export", fmt::format("{}", fmt::join(o.exports, ","))});
    return words;
  }

  std::unique_ptr<LimitedProcess> start(const Work& work) {
    std::vector<std::string> words = words_for(work, folder_of(out_, work.result).string());
    const std::string threads = std::to_string(std::max(1, thread_count() / jobs_));
    words.insert(words.end(),
                 {"--store", store_folder_.string(), "--picture", "--threads", threads, "--json", "--quiet"});
    make_folder(folder_of(out_, work.result));
    return std::make_unique<LimitedProcess>(words, limits_);
  }

  void settle(Work& work, const EndedProcess& end) {
    const SaidByPrepare said =
        fields_or_nothing<SaidByPrepare>(Json::parse(end.out, nullptr, false)).value_or(SaidByPrepare{});
    Attempt attempt{.name = work.result.model.name,
                    .key = work.result.key,
                    .reason = "",
                    .message = "",
                    .clock_s = std::round(1e3 * end.clock_s) / 1e3,
                    .cpu_s = std::round(1e3 * end.cpu_s) / 1e3,
                    .peak_mb = std::round(end.peak_mb),
                    .time_limit_s = limits_.cpu_s,
                    .memory_mb = limits_.memory_mb,
                    .also_written = {},
                    .cpu_seconds = {}};
    work.pending = false;
    judge(work, end, said);
    if (work.found == Outcome::failed) {
      attempt.reason = work.result.reason, attempt.message = work.result.message;
      log::warn("{}: {}: {}", work.result.model.name, work.result.reason, work.result.message);
    } else {
      attempt.cpu_seconds = said.cpu_seconds, attempt.also_written = said.also_written;
    }
    journal_->add(attempt);
  }

  void judge(Work& work, const EndedProcess& end, const SaidByPrepare& said) {
    const std::string error = said.error.value_or(last_line(end.err));
    const auto failed = [&](const char* reason, const std::string& message) {
      fail(work, reason, message, Outcome::failed);
    };
    if (end.reason == EndedProcess::out_of_time)
      return failed("time",
                    fmt::format("takes more than {:g} s of CPU time, or {:g} s by the clock; give more with "
                                "--time-limit",
                                limits_.cpu_s, limits_.clock_s));
    if (end.reason == EndedProcess::out_of_memory ||
        (end.reason == EndedProcess::exited && error == not_enough_memory))
      return failed("memory",
                    fmt::format("takes more than {:g} MB; give more with --memory-limit", limits_.memory_mb));
    if (end.reason == EndedProcess::crashed)
      return failed("crash",
                    fmt::format("limber ended by the signal {} ({}){}{}", end.code, ::strsignal(end.code),
                                error.empty() ? "" : "; its last words: ", error));
    if (end.code == exit_disk) throw DiskError(error);
    if (end.code == exit_bad_input) return failed("refused", error);
    if (end.code != exit_done || !said.cpu_seconds)
      return failed("defect",
                    error.empty() ? fmt::format("limber ended with exit code {}", end.code) : error);
    if (said.input ? said.input->model != work.identity : true)
      return failed("refused", "the file changed while it was read; start once more");
  }

  static std::string last_line(std::string text) {
    while (text.ends_with('\n')) text.pop_back();
    return text.substr(text.rfind('\n') + 1);
  }

  static void stop(std::vector<Running>& running) {
    for (const Running& one : running) one.process->stop();
    for (double waited_s = 0; waited_s < patience_s && !running.empty();
         waited_s += 1e-6 * between_looks_us) {
      ::usleep(between_looks_us);
      std::erase_if(running, [](const Running& one) { return one.process->ended().has_value(); });
    }
    running.clear();  // kills the rest
  }

  // Why it failed, and how to see that again.
  void write_quarantine() const {
    std::set<fs::path> files;
    for (const Work& work : work_) {
      const fs::path folder = folder_of(out_, work.result);
      if (work.result.reason.empty()) continue;
      const fs::path file = quarantine_file_of(out_, work.result);
      files.insert(file);
      const std::string text =
          fmt::format("{}: {}\n\nmodel     {}\nkey       {}\nonce more limber {}\n", work.result.reason,
                      work.result.message, work.result.model.file.string(), work.result.key,
                      fmt::join(words_for(work, "DIR"), " "));
      std::error_code none;
      if (!fs::exists(file, none) || read_file(file) != text) write_file(file, text);
      if (!fs::is_directory(folder, none)) continue;
      remove_abandoned(folder);
      clear_body(folder);
      fs::remove(folder, none);  // where nothing of the user's is in it
    }
    std::vector<fs::path> others;
    for (const auto& entry : fs::directory_iterator(out_ / "failed"))
      if (!files.contains(entry.path()) && entry.path().extension() == ".txt") others.push_back(entry.path());
    for (const fs::path& file : others) fs::remove(file);
  }

  PreparedMany finish() {
    write_quarantine();
    std::vector<BatchModel> results;
    for (const Work& work : work_) results.push_back(work.result);
    write_tables(out_, results, *journal_);
    write_pages(out_, results);
    PreparedMany prepared = counts();
    prepared.manifest = out_ / "manifest.jsonl", prepared.table = out_ / "manifest.csv";
    prepared.page = out_ / "index.html";
    return prepared;
  }

  PreparedMany counts() const {
    std::map<Outcome, int> count;
    PreparedMany prepared;
    for (const Work& work : work_) {
      ++count[work.found];
      if (work.result.reason.empty()) continue;
      ++prepared.reasons[work.result.reason];
      prepared.not_prepared.push_back(work.result);
    }
    prepared.models = int(work_.size());
    prepared.made = count[Outcome::made], prepared.in_store = count[Outcome::in_store];
    prepared.up_to_date = count[Outcome::up_to_date];
    prepared.failed = count[Outcome::failed], prepared.failed_before = count[Outcome::failed_before];
    return prepared;
  }

  const BatchOptions& options_;
  const fs::path out_;
  const std::string part_;
  fs::path store_folder_;
  int jobs_;
  ProcessLimits limits_{};
  std::unique_ptr<BodyStore> store_;
  std::unique_ptr<Journal> journal_;
  std::vector<Work> work_;
};

}  // namespace

double memory_share_mb(int jobs) {
  constexpr double mib = 1 << 20;
  const double machine_mb = double(::sysconf(_SC_PHYS_PAGES)) * double(::sysconf(_SC_PAGESIZE)) / mib;
  return std::floor(0.75 * machine_mb / jobs);
}

PreparedMany prepare_many(const BatchOptions& options) { return Batch(options).run(); }

PreparedMany prepare_part(const BatchOptions& options, const std::string& part,
                          const std::vector<std::size_t>& which) {
  return Batch(options, part).run_part(which);
}

}  // namespace limber::detail
