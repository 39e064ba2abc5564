#include "integrate/sweep/workers.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"

namespace pendula::integrate {

struct alignas(64)
    SharedSlots::Head {  // stored apart from the numbers, so that pages of unfinished tasks stay untouched
  std::atomic<int> state, worker;
  char failure[longest_text];
};

namespace {

constexpr int most_workers = 1024;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Data shared by all workers, stored before the slots.
struct Counters {
  std::atomic<int> next;                    ///< task to be handed out
  std::atomic<int> finished;                ///< tasks done or failed
  std::atomic<double> since[most_workers];  ///< when a worker took its last task; 0: it has not yet
};
constexpr std::size_t front = (sizeof(Counters) + 63) / 64 * 64;
Counters& counters(char* memory) { return *reinterpret_cast<Counters*>(memory); }

bool is_final(int state) {
  return state == static_cast<int>(SharedSlots::State::done) ||
         state == static_cast<int>(SharedSlots::State::failed);
}

}  // namespace

SharedSlots::SharedSlots(std::vector<int> runs, std::size_t numbers)
    : runs_(std::move(runs)), numbers_(numbers), stride_((numbers * sizeof(double) + 63) / 64 * 64) {
  bytes_ = front + runs_.size() * (sizeof(Head) + stride_);
  void* memory =
      mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED)
    throw Error(text("there is no memory for ", runs_.size(), " results of ", numbers,
                     " numbers each; give fewer times, or store = \"runs.db\""));
  memory_ = static_cast<char*>(memory);  // zeroed: every task is waiting
}

SharedSlots::~SharedSlots() { munmap(memory_, bytes_); }

SharedSlots::Head* SharedSlots::head(int task) const {
  return reinterpret_cast<Head*>(memory_ + front) + task;
}
double* SharedSlots::numbers(int task) const {
  char* all = memory_ + front + runs_.size() * sizeof(Head);
  return reinterpret_cast<double*>(all + static_cast<std::size_t>(task) * stride_);
}
SharedSlots::State SharedSlots::state(int task) const { return static_cast<State>(head(task)->state.load()); }
std::string SharedSlots::failure(int task) const { return head(task)->failure; }

void SharedSlots::set(int task, State state, const std::string& failure) {
  Head* h = head(task);
  std::size_t length = std::min<std::size_t>(failure.size(), longest_text - 1);
  while (length < failure.size() && length > 0 &&
         (static_cast<unsigned char>(failure[length]) & 0xC0) == 0x80)
    --length;  // do not split a UTF-8 character
  std::memcpy(h->failure, failure.data(), length);
  h->failure[length] = 0;
  const int before = h->state.exchange(static_cast<int>(state));
  counters(memory_).finished += is_final(static_cast<int>(state)) - is_final(before);
}

int SharedSlots::finished() const { return counters(memory_).finished; }

std::optional<int> TaskQueue::next() {
  Counters& c = counters(slots_.memory_);
  for (int i = c.next.fetch_add(1); i < slots_.tasks(); i = c.next.fetch_add(1)) {
    if (slots_.state(i) != SharedSlots::State::waiting) continue;
    slots_.head(i)->worker = worker_;
    c.since[worker_] = now();
    slots_.set(i, SharedSlots::State::running);
    return i;
  }
  c.since[worker_] = 0;
  return {};
}
void TaskQueue::begin_again() { counters(slots_.memory_).next = 0; }

int available_workers() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

namespace {

/// Processes tasks until none is left; false if interrupted.
bool work(TaskQueue& queue, const std::function<void(TaskQueue&)>& drain) {
  try {
    drain(queue);
    return true;
  } catch (const Interrupted&) {
    return false;
  }
}

/// Processes tasks one at a time, at most `limit`.
void drain_singly(SharedSlots& slots, TaskQueue& queue, const std::function<void(int, double*)>& run,
                  const std::function<void(int)>& progress, int limit = std::numeric_limits<int>::max()) {
  for (int k = 0; k < limit; ++k) {
    const auto claimed = queue.next();
    if (!claimed) return;
    const int i = *claimed;
    try {
      poll_interrupt();
      run(i, slots.numbers(i));
      slots.set(i, SharedSlots::State::done);
    } catch (const Interrupted&) {
      slots.set(i, SharedSlots::State::waiting);
      throw;
    } catch (const UserFacing& error) {
      slots.set(i, SharedSlots::State::failed, error.what());
    } catch (const std::bad_alloc&) {
      slots.set(i, SharedSlots::State::failed, "not enough memory");
    }
    if (progress) progress(slots.finished());
  }
}

}  // namespace

/// The worker processes of one queue. A worker that dies, or is killed because its task exceeds the time
/// limit, is replaced. Its task becomes `failed`, or `apart` if workers hold several tasks at a time.
class WorkerPool {
 public:
  WorkerPool(SharedSlots& slots, const WorkerOptions& options, const std::function<void(TaskQueue&)>& drain,
             bool several)
      : slots_(slots),
        options_(options),
        drain_(drain),
        several_(several),
        pids_(std::min(options.workers, most_workers)),
        overdue_(pids_.size()) {
    std::fflush(nullptr);  // buffered output must not be written twice
    for (std::size_t k = 0; k < pids_.size(); ++k) fork_worker(k);
  }
  ~WorkerPool() {
    signal_all(SIGKILL);  // after an error only; otherwise all have ended
    for (pid_t pid : pids_)
      if (pid > 0) waitpid(pid, nullptr, 0);
  }
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  bool is_empty() const {
    return std::all_of(pids_.begin(), pids_.end(), [](pid_t pid) { return pid <= 0; });
  }

  /// Waits until all have ended, polling to show progress and forward Ctrl-C. A worker that does not end
  /// within two seconds of that, because it was stopped (SIGSTOP) or does not poll, is killed.
  void wait() {
    constexpr double patience = 2;  // seconds
    double signalled_at = 0;
    while (true) {
      reap(signalled_at > 0);
      if (is_empty()) return;
      usleep(2000);
      if (options_.progress) options_.progress(slots_.finished());
      if (options_.limit > 0) kill_overdue();
      if (interrupt_requested && signalled_at == 0) {
        signal_all(SIGINT);
        signalled_at = now();
      }
      if (signalled_at > 0 && now() - signalled_at > patience) signal_all(SIGKILL);
    }
  }

 private:
  using State = SharedSlots::State;
  void fork_worker(std::size_t k) {
    counters(slots_.memory_).since[k] = 0;
    const pid_t parent = getpid();
    pids_[k] = fork();
    if (pids_[k] == 0) run_worker(k, parent);
  }

  [[noreturn]] void run_worker(std::size_t k, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);   // results of an orphan would be lost
    if (getppid() != parent) _exit(1);  // the parent may have ended before that call
    int status = 1;
    try {
      TaskQueue queue(slots_, static_cast<int>(k));
      work(queue, drain_);
      status = 0;
    } catch (const std::exception&) {
    }
    std::fflush(nullptr);
    _exit(status);
  }

  void reap(bool ending) {
    for (std::size_t k = 0; k < pids_.size(); ++k) {
      int status = 0;
      if (pids_[k] <= 0 || waitpid(pids_[k], &status, WNOHANG) == 0) continue;
      pids_[k] = 0;
      if (WIFEXITED(status) && WEXITSTATUS(status) == 0) continue;
      std::string why = "its worker process ended unexpectedly";
      if (WIFSIGNALED(status)) why += text(" (signal ", WTERMSIG(status), ")");
      State then = several_ ? State::apart : State::failed;
      if (overdue_[k] > 0) why = text("it took longer than limit = ", shortest(options_.limit), " seconds");
      const bool took_another = overdue_[k] > 0 && overdue_[k] != counters(slots_.memory_).since[k];
      if (ending || took_another) then = State::waiting;
      overdue_[k] = 0;
      give_up(static_cast<int>(k), then, why);
      if (!ending && counters(slots_.memory_).next < slots_.tasks()) fork_worker(k);
    }
  }

  /// Sets the state of the tasks of a dead worker.
  void give_up(int worker, State then, const std::string& why) {
    for (int i = 0; i < slots_.tasks(); ++i)
      if (slots_.state(i) == State::running && slots_.head(i)->worker == worker) slots_.set(i, then, why);
  }

  void kill_overdue() {
    for (std::size_t k = 0; k < pids_.size(); ++k) {
      const double since = counters(slots_.memory_).since[k];
      if (pids_[k] <= 0 || since == 0 || now() - since <= options_.limit || overdue_[k] > 0) continue;
      overdue_[k] = since;
      kill(pids_[k], SIGKILL);
    }
  }

  void signal_all(int signal) {  // own children; the terminal may have signalled them already
    for (pid_t pid : pids_)
      if (pid > 0) kill(pid, signal);
  }

  SharedSlots& slots_;
  const WorkerOptions& options_;
  const std::function<void(TaskQueue&)>& drain_;
  bool several_;
  std::vector<pid_t> pids_;
  std::vector<double> overdue_;  ///< > 0: killed because of the task taken at this time
};

namespace {

bool share_out(SharedSlots& slots, const WorkerOptions& options, const std::function<void(TaskQueue&)>& drain,
               bool several) {
  TaskQueue queue(slots);
  queue.begin_again();
  if (options.workers <= 1 && options.limit <= 0) return work(queue, drain);
  const auto is_waiting = [&] {
    for (int i = 0; i < slots.tasks(); ++i)
      if (slots.state(i) == SharedSlots::State::waiting) return true;
    return false;
  };
  do {  // a killed process may have claimed a task without starting it
    queue.begin_again();
    WorkerPool pool(slots, options, drain, several);
    if (pool.is_empty()) return work(queue, drain);  // no process could be started; work in this one
    pool.wait();
    if (interrupt_requested) return false;
  } while (is_waiting());
  return true;
}

}  // namespace

bool run_tasks(SharedSlots& slots, const WorkerOptions& options,
               const std::function<void(int, double*)>& run) {
  const pid_t here = getpid();
  const auto drain = [&](TaskQueue& queue) {
    drain_singly(slots, queue, run, getpid() == here ? options.progress : nullptr);
  };
  return share_out(slots, options, drain, false);
}

bool run_tasks_here_first(SharedSlots& slots, const WorkerOptions& options,
                          const std::function<void(int, double*)>& run) {
  if (slots.finished() == slots.tasks()) return true;
  if (options.limit > 0) return run_tasks(slots, options, run);
  constexpr int few = 3;
  const int before = slots.finished();
  const std::clock_t begin = std::clock();
  TaskQueue queue(slots);
  queue.begin_again();
  if (!work(queue, [&](TaskQueue& q) { drain_singly(slots, q, run, options.progress, few); })) return false;
  const int left = slots.tasks() - slots.finished();
  if (left == 0) return true;
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const bool here = seconds / (slots.finished() - before) * left < worth_a_process;
  return run_tasks(slots, {here ? 1 : std::min(options.workers, left), 0, options.progress}, run);
}

bool run_queue(SharedSlots& slots, const WorkerOptions& options,
               const std::function<void(TaskQueue&)>& drain) {
  return share_out(slots, options, drain, true);
}

}  // namespace pendula::integrate
