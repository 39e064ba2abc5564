// Writes the runs of a sweep to a store or a shard as they finish.
#include <algorithm>
#include <chrono>

#include "integrate/sweep/sweep.hpp"

namespace pendula::integrate {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double most_bytes = 64e6;                ///< of the results that wait to be written
constexpr std::size_t fewest = 256, most = 65536;  ///< runs in a block
constexpr auto between = std::chrono::milliseconds(500);

/// Writes finished runs, at most twice a second.
class Recorder {
 public:
  Recorder(const Sweep& sweep, const SharedSlots& slots, store::RunSink& sink)
      : sweep_(sweep), slots_(slots), sink_(sink), written_(slots.tasks()), last_(Clock::now()) {}

  void write_if_due() {
    if (Clock::now() - last_ < between) return;
    write();
    last_ = Clock::now();
  }

  void write() {
    std::vector<store::Record> records;
    for (int task = first_; task < slots_.tasks(); ++task) {
      const auto state = slots_.state(task);
      const bool finished = state == SharedSlots::State::done || state == SharedSlots::State::failed;
      if (written_[task] || !finished) continue;
      written_[task] = true;
      records.push_back(sweep_.record(slots_, task));
    }
    while (first_ < slots_.tasks() && written_[first_]) ++first_;
    sink_.add(records);
  }

 private:
  const Sweep& sweep_;
  const SharedSlots& slots_;
  store::RunSink& sink_;
  std::vector<bool> written_;
  int first_ = 0;  ///< all runs before it are written
  Clock::time_point last_;
};

}  // namespace

store::Record Sweep::record(const SharedSlots& slots, int task) const {
  store::Record r;
  r.run = slots.run(task);
  r.done = slots.state(task) == SharedSlots::State::done;
  if (request_.varied) r.varied = request_.varied(slots.run(task));
  if (r.done) {
    const double* numbers = slots.numbers(task);
    r.numbers.assign(numbers, numbers + numbers_of(times_));
  } else {
    r.why = slots.failure(task);
  }
  return r;
}

bool Sweep::run_into(store::RunSink& sink, int first, int last, const Progress& progress) const {
  const std::vector<bool> there = sink.finished();
  const double bytes = static_cast<double>(numbers_of(times_)) * sizeof(double) + 512;
  const auto block = static_cast<std::size_t>(std::clamp(most_bytes / bytes, double(fewest), double(most)));
  int before = static_cast<int>(std::count(there.begin() + first, there.begin() + last, true));
  for (int next = first; next < last;) {
    std::vector<int> runs;
    for (; next < last && runs.size() < block; ++next)
      if (!there[next]) runs.push_back(next);
    if (runs.empty()) continue;
    SharedSlots slots(std::move(runs), numbers_of(times_));
    Recorder recorder(*this, slots, sink);
    const bool complete = run_all(slots, times_, [&](int done) {
      recorder.write_if_due();
      if (progress) progress(before + done);
    });
    recorder.write();
    before += slots.finished();
    if (!complete) return false;
  }
  return true;
}

}  // namespace pendula::integrate
