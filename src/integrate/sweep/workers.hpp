// Many independent computations in worker processes.
//
// Forked processes and not threads: the expression graph and a Lua state belong to one thread, and a run may
// need both (a consistent start, an input or event written in Lua). A forked worker has its own copy of
// everything at no cost, so a run does there exactly what it would do here
// (docs/decisions/003-sweeps-in-processes.md). What a run writes to variables stays in its worker; only the
// numbers below come back.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace pendula::integrate {

/// One slot of numbers per task, shared with the workers.
class SharedSlots {
 public:
  enum class State : int { waiting = 0, running, done, failed, apart };  ///< apart: left for another road
  static constexpr int longest_text = 480;                               ///< of a failure, in bytes

  /// Throws Error when the memory is not there.
  SharedSlots(int tasks, std::size_t numbers);
  ~SharedSlots();
  SharedSlots(const SharedSlots&) = delete;
  SharedSlots& operator=(const SharedSlots&) = delete;

  int tasks() const { return tasks_; }
  double* numbers(int task) const;
  State state(int task) const;
  std::string failure(int task) const;
  void set(int task, State state, const std::string& failure = "");
  int finished() const;  ///< done or failed

 private:
  friend class TaskQueue;
  struct Head;
  Head* head(int task) const;
  int tasks_;
  std::size_t numbers_, stride_, bytes_;
  char* memory_;
};

/// Hands out tasks to all workers.
class TaskQueue {
 public:
  explicit TaskQueue(SharedSlots& slots) : slots_(slots) {}
  /// Claims a waiting task, which is `running` then; -1: none is left.
  int next();
  void begin_again();

 private:
  SharedSlots& slots_;
};

/// Processors this process may use.
int available_workers();

/// Runs run(task, numbers) for every waiting task; a task that throws a user-facing error is failed with its
/// text, one whose process dies is failed too. workers ≤ 1: all in this process. progress(finished) is called
/// now and then. Returns false when Ctrl-C stopped it: the tasks that are done stay done.
bool run_tasks(SharedSlots& slots, int workers, const std::function<void(int, double*)>& run,
               const std::function<void(int)>& progress);

/// The same for tasks that are worked on several at a time: drain(queue) is called in every worker and takes
/// tasks until there is none. It sets their states; when it throws Interrupted, none of its tasks may be left
/// running.
bool run_queue(SharedSlots& slots, int workers, const std::function<void(TaskQueue&)>& drain,
               const std::function<void(int)>& progress);

}  // namespace pendula::integrate
