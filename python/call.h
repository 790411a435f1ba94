// Calls of the library that take long, from Python: in a thread of their own, without the GIL, stopped by
// Ctrl-C.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "limber/limber.h"

namespace limber_python {

namespace py = pybind11;

// Hears what a call tells, and hands it to Python.
class PythonWatcher final : public limber::Watcher {
 public:
  explicit PythonWatcher(py::object progress) : progress_(std::move(progress)) {}

  void progress(const std::string& stage, std::int64_t done, std::int64_t total,
                const std::string& note) override {
    if (stop_ || progress_.is_none()) return;
    const py::gil_scoped_acquire gil;
    try {
      progress_(stage, done, total, note);
    } catch (py::error_already_set& error) {
      keep(error);
    }
  }
  void warn(const std::string& text) override { warnings_.push_back(text); }
  bool stop() override { return stop_; }

  // Needs the GIL. What Python raised; the call is to end.
  void keep(py::error_already_set& error) {
    if (!raised_) raised_.emplace(error);
    stop_ = true;
  }
  // Needs the GIL, when the call has ended.
  void tell_warnings() const {
    if (warnings_.empty()) return;
    int level = 1;  // of the first frame that is not limber's own
    py::object frame = py::module_::import("sys").attr("_getframe")(0);
    const auto is_ours = [](const py::object& of) {
      const py::object name = of.attr("f_globals").attr("get")("__name__", "");
      return py::isinstance<py::str>(name) && name.cast<std::string>() == "limber";
    };
    for (; !frame.is_none() && is_ours(frame); frame = frame.attr("f_back")) ++level;
    for (const std::string& text : warnings_)
      if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), level) != 0) throw py::error_already_set();
  }
  bool has_raised() const { return raised_.has_value(); }
  void raise_what_was_raised() {
    if (raised_) throw *raised_;
  }

 private:
  py::object progress_;
  std::vector<std::string> warnings_;
  std::atomic<bool> stop_{false};
  std::optional<py::error_already_set> raised_;
};

// Works in a thread of its own, without the GIL, while this one listens for Ctrl-C. `keep` is called with
// what there is, where a call ends by what Python raised and still has a result.
template <class F>
auto call(const py::object& progress, int threads, F&& work, const py::object& keep = py::none()) {
  using Result = decltype(work(limber::Context{}));
  PythonWatcher watcher(progress);
  std::optional<Result> result;
  std::exception_ptr failure;
  std::mutex mutex;
  std::condition_variable ended;
  bool has_ended = false;
  std::thread worker([&] {
    try {
      result.emplace(work(limber::Context{&watcher, threads}));
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    has_ended = true;
    ended.notify_one();
  });
  {
    const py::gil_scoped_release no_gil;
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, std::chrono::milliseconds(50), [&] { return has_ended; })) {
      lock.unlock();
      {
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0) {
          py::error_already_set error;
          watcher.keep(error);
        }
      }
      lock.lock();
    }
    lock.unlock();
    worker.join();
  }
  if (watcher.has_raised() && result && !keep.is_none()) keep(py::cast(std::move(*result)));
  watcher.raise_what_was_raised();
  if (failure) std::rethrow_exception(failure);
  watcher.tell_warnings();
  return std::move(*result);
}

}  // namespace limber_python
