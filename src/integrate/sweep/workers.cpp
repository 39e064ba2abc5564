#include "integrate/sweep/workers.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::integrate {

struct alignas(64) SharedSlots::Head {  // numbers follow it
  std::atomic<int> state;
  char failure[longest_text];
};

namespace {

constexpr std::size_t front = 64;  ///< what all workers count

struct Counters {
  std::atomic<int> next;      ///< task to be handed out
  std::atomic<int> finished;  ///< tasks done or failed
};
Counters& counters(char* memory) { return *reinterpret_cast<Counters*>(memory); }

bool is_final(int state) {
  return state == static_cast<int>(SharedSlots::State::done) ||
         state == static_cast<int>(SharedSlots::State::failed);
}

}  // namespace

SharedSlots::SharedSlots(int tasks, std::size_t numbers)
    : tasks_(tasks), numbers_(numbers), stride_((sizeof(Head) + numbers * sizeof(double) + 63) / 64 * 64) {
  bytes_ = front + static_cast<std::size_t>(tasks) * stride_;
  void* memory =
      mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED)
    throw Error(
        text("there is no memory for ", tasks, " results of ", numbers, " numbers each; give fewer times"));
  memory_ = static_cast<char*>(memory);  // filled with zeros: every task is waiting
}

SharedSlots::~SharedSlots() { munmap(memory_, bytes_); }

SharedSlots::Head* SharedSlots::head(int task) const {
  return reinterpret_cast<Head*>(memory_ + front + static_cast<std::size_t>(task) * stride_);
}
double* SharedSlots::numbers(int task) const { return reinterpret_cast<double*>(head(task) + 1); }
SharedSlots::State SharedSlots::state(int task) const { return static_cast<State>(head(task)->state.load()); }
std::string SharedSlots::failure(int task) const { return head(task)->failure; }

void SharedSlots::set(int task, State state, const std::string& failure) {
  Head* h = head(task);
  std::size_t length = std::min<std::size_t>(failure.size(), longest_text - 1);
  while (length < failure.size() && length > 0 &&
         (static_cast<unsigned char>(failure[length]) & 0xC0) == 0x80)
    --length;  // never half a character
  std::memcpy(h->failure, failure.data(), length);
  h->failure[length] = 0;
  const int before = h->state.exchange(static_cast<int>(state));
  counters(memory_).finished += is_final(static_cast<int>(state)) - is_final(before);
}

int SharedSlots::finished() const { return counters(memory_).finished; }

int TaskQueue::next() {
  std::atomic<int>& next = counters(slots_.memory_).next;
  for (int i = next.fetch_add(1); i < slots_.tasks(); i = next.fetch_add(1)) {
    if (slots_.state(i) != SharedSlots::State::waiting) continue;
    slots_.set(i, SharedSlots::State::running);
    return i;
  }
  return -1;
}
void TaskQueue::begin_again() { counters(slots_.memory_).next = 0; }

int available_workers() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

namespace {

/// Works off tasks until none is left; false if interrupted.
bool work(TaskQueue& queue, const std::function<void(TaskQueue&)>& drain) {
  try {
    drain(queue);
    return true;
  } catch (const Interrupted&) {
    return false;
  }
}

/// Task after task.
void drain_singly(SharedSlots& slots, TaskQueue& queue, const std::function<void(int, double*)>& run,
                  const std::function<void(int)>& progress) {
  for (int i = queue.next(); i >= 0; i = queue.next()) {
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

/// Waits for the workers, polling so that progress is shown and Ctrl-C is passed on. One that does not end within
/// two seconds of it, because it was stopped (SIGSTOP) or does not poll, is killed.
void wait_for(std::vector<pid_t> workers, const SharedSlots& slots,
              const std::function<void(int)>& progress) {
  using Clock = std::chrono::steady_clock;
  constexpr auto patience = std::chrono::seconds(2);
  bool told = false;
  Clock::time_point told_at;
  const auto tell = [&](int signal) {  // our own children; the terminal may have told them already
    for (pid_t worker : workers) kill(worker, signal);
  };
  while (!workers.empty()) {
    for (std::size_t k = 0; k < workers.size();) {
      int status = 0;
      if (waitpid(workers[k], &status, WNOHANG) == 0) {
        ++k;
      } else {
        workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(k));
      }
    }
    if (workers.empty()) break;
    usleep(2000);
    if (progress) progress(slots.finished());
    if (interrupt_requested && !told) {
      tell(SIGINT);
      told = true;
      told_at = Clock::now();
    }
    if (told && Clock::now() - told_at > patience) tell(SIGKILL);
  }
}

}  // namespace

bool run_tasks(SharedSlots& slots, int workers, const std::function<void(int, double*)>& run,
               const std::function<void(int)>& progress) {
  const pid_t here = getpid();
  const auto drain = [&](TaskQueue& queue) {
    drain_singly(slots, queue, run, getpid() == here ? progress : nullptr);
  };
  return run_queue(slots, workers, drain, progress);
}

bool run_queue(SharedSlots& slots, int workers, const std::function<void(TaskQueue&)>& drain,
               const std::function<void(int)>& progress) {
  TaskQueue queue(slots);
  queue.begin_again();
  if (workers <= 1) return work(queue, drain);
  std::fflush(nullptr);  // what stands in buffers must not be written twice
  std::vector<pid_t> children;
  const pid_t parent = getpid();
  for (int k = 0; k < workers; ++k) {
    const pid_t child = fork();
    if (child == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);   // nobody waits for the results of an orphan
      if (getppid() != parent) _exit(1);  // it ended before the line above
      int status = 1;
      try {
        work(queue, drain);
        status = 0;
      } catch (const std::exception&) {
      }
      std::fflush(nullptr);
      _exit(status);
    }
    if (child > 0) children.push_back(child);
  }
  if (children.empty()) return work(queue, drain);  // no more processes allowed: here, then
  wait_for(std::move(children), slots, progress);
  if (interrupt_requested) return false;
  for (int i = 0; i < slots.tasks(); ++i)
    if (slots.state(i) == SharedSlots::State::running)
      slots.set(i, SharedSlots::State::failed, "its worker process ended unexpectedly");
  queue.begin_again();
  return work(queue, drain);  // what dead workers left
}

}  // namespace pendula::integrate
