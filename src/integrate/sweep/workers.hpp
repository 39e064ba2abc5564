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
#include <optional>
#include <string>
#include <vector>

namespace pendula::integrate {

/// One slot of numbers per task, shared with the workers.
class SharedSlots {
 public:
  enum class State : int { waiting = 0, running, done, failed, apart };  ///< apart: left for a run of its own
  static constexpr int longest_text = 480;                               ///< of a failure, in bytes

  /// runs: what each task stands for. Throws Error when the memory is not there.
  SharedSlots(std::vector<int> runs, std::size_t numbers);
  ~SharedSlots();
  SharedSlots(const SharedSlots&) = delete;
  SharedSlots& operator=(const SharedSlots&) = delete;

  int tasks() const { return static_cast<int>(runs_.size()); }
  int run(int task) const { return runs_[task]; }
  double* numbers(int task) const;
  State state(int task) const;
  std::string failure(int task) const;
  void set(int task, State state, const std::string& failure = "");
  int finished() const;  ///< done or failed

 private:
  friend class TaskQueue;
  friend class WorkerPool;
  struct Head;
  Head* head(int task) const;
  std::vector<int> runs_;
  std::size_t numbers_, stride_, bytes_;
  char* memory_;
};

/// Hands out tasks to all workers.
class TaskQueue {
 public:
  explicit TaskQueue(SharedSlots& slots, int worker = 0) : slots_(slots), worker_(worker) {}
  /// Claims a waiting task, which is `running` then; nothing: none is left.
  std::optional<int> next();
  void begin_again();

 private:
  SharedSlots& slots_;
  int worker_;
};

/// Processors this process may use.
int available_workers();

/// How tasks are shared out.
struct WorkerOptions {
  int workers = 1;                             ///< processes; 1: this one, unless there is a limit
  double limit = 0;                            ///< seconds that one task may take; 0: any time
  std::function<void(int finished)> progress;  ///< called now and then, here; what it throws ends the work
};

/// Runs run(task, numbers) for every waiting task; a task that throws a user-facing error is failed with its
/// text, and so is one whose process dies or that takes too long; another process goes on with the others
/// then. Returns false when Ctrl-C stopped it: the tasks that are done stay done.
bool run_tasks(SharedSlots& slots, const WorkerOptions& options,
               const std::function<void(int, double*)>& run);

/// The same after a few tasks in this process, which fill caches that the workers inherit and tell how long a
/// task takes: where processes would cost more than they save, all tasks are done here. With a limit none is.
bool run_tasks_here_first(SharedSlots& slots, const WorkerOptions& options,
                          const std::function<void(int, double*)>& run);

/// Tasks so short that starting processes for them would cost more than they save.
constexpr double worth_a_process = 0.02;  // seconds in all

/// The same for tasks that are worked on several at a time: drain(queue) is called in every worker and takes
/// tasks until there is none. It sets their states; when it throws Interrupted, none of its tasks may be left
/// running. Tasks of a process that dies are `apart` afterwards.
bool run_queue(SharedSlots& slots, const WorkerOptions& options,
               const std::function<void(TaskQueue&)>& drain);

}  // namespace pendula::integrate
