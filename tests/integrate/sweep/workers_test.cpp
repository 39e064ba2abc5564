// Worker processes: every task is done once, failures and dead workers are told apart,
// an interrupt keeps what is done.
#include "integrate/sweep/workers.hpp"

#include <atomic>
#include <cmath>
#include <csignal>

#include <doctest/doctest.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::workers_test {

using namespace pendula::integrate;
using State = SharedSlots::State;

namespace {

std::vector<int> numbered(int tasks) {
  std::vector<int> runs(tasks);
  for (int i = 0; i < tasks; ++i) runs[i] = i;
  return runs;
}

WorkerOptions with(int workers, std::function<void(int)> progress = {}, double limit = 0) {
  return {workers, limit, std::move(progress)};
}

}  // namespace

TEST_CASE("workers: all tasks are done once, with the numbers of their own slot") {
  for (int workers : {1, 2, 5}) {
    CAPTURE(workers);
    SharedSlots slots(numbered(100), 3);
    const bool complete = run_tasks(slots, with(workers), [](int task, double* numbers) {
      numbers[0] += task;  // a second run of the task would show
      numbers[1] = std::sqrt(task);
      numbers[2] = -1;
    });
    CHECK(complete);
    CHECK(slots.finished() == 100);
    for (int i = 0; i < 100; ++i) {
      CHECK(slots.state(i) == State::done);
      CHECK(slots.numbers(i)[0] == i);
      CHECK(slots.numbers(i)[1] == std::sqrt(i));
    }
  }
}

TEST_CASE("workers: a user-facing error fails its task alone; a long text is cut between characters") {
  SharedSlots slots(numbered(20), 1);
  run_tasks(slots, with(3), [](int task, double*) {
    if (task == 7) throw Failure("step 7 ‖r‖");
    if (task == 8) {
      std::string text;
      for (int i = 0; i < 300; ++i) text += "‖";
      throw Error(text);
    }
  });
  CHECK(slots.state(7) == State::failed);
  CHECK(slots.failure(7) == "step 7 ‖r‖");
  CHECK(slots.failure(8).size() % 3 == 0);
  CHECK(slots.failure(8).size() > 450);
  CHECK(slots.state(9) == State::done);
}

TEST_CASE("workers: a process that dies fails its task, the others go on") {
  SharedSlots slots(numbered(40), 1);
  const auto parent = getpid();
  const bool complete = run_tasks(slots, with(2), [parent](int task, double* numbers) {
    if (task == 3 && getpid() != parent) _exit(9);
    numbers[0] = 1;
  });
  CHECK(complete);
  CHECK(slots.state(3) == State::failed);
  CHECK(slots.failure(3) == "its worker process ended unexpectedly");
  for (int i = 0; i < 40; ++i)
    if (i != 3) CHECK(slots.numbers(i)[0] == 1);
}

// Seconds of tasks of a millisecond: on a loaded machine the process that stops them
// may wait that long for its turn.
constexpr int many = 20'000;

TEST_CASE("workers: an interrupt stops, what is done stays done") {
  for (int workers : {1, 2}) {
    CAPTURE(workers);
    SharedSlots slots(numbered(many), 1);
    std::atomic<bool> asked = false;
    const auto progress = [&](int done) {
      if (done > 10 && !asked.exchange(true)) interrupt_requested = true;
    };
    const bool complete = run_tasks(slots, with(workers, progress), [](int, double* numbers) {
      numbers[0] = 1;
      usleep(1000);
    });
    interrupt_requested = false;
    CHECK_FALSE(complete);
    CHECK(slots.finished() > 10);
    CHECK(slots.finished() < many);
  }
}

TEST_CASE("workers: a task that hangs costs itself, whatever the number of workers") {
  for (int workers : {1, 3}) {
    CAPTURE(workers);
    SharedSlots slots(numbered(30), 1);
    const bool complete = run_tasks(slots, with(workers, {}, 0.2), [](int task, double* numbers) {
      while (task == 4 || task == 29) usleep(10'000);
      numbers[0] = 1;
    });
    CHECK(complete);
    for (int i = 0; i < 30; ++i) {
      if (i == 4 || i == 29) {
        CHECK(slots.state(i) == State::failed);
        CHECK(slots.failure(i) == "it took longer than limit = 0.2 seconds");
      } else {
        CHECK(slots.state(i) == State::done);
      }
    }
  }
}

TEST_CASE("workers: every task may kill its process, nothing else is lost and this process goes on") {
  SharedSlots slots(numbered(60), 1);
  const bool complete = run_tasks(slots, with(2), [](int task, double*) {
    if (task % 2 == 1) raise(SIGKILL);
  });
  CHECK(complete);
  for (int i = 0; i < 60; ++i) CHECK(slots.state(i) == (i % 2 == 1 ? State::failed : State::done));
  CHECK(slots.failure(59) == "its worker process ended unexpectedly (signal 9)");
}

TEST_CASE("workers: what progress throws ends the workers and is thrown on") {
  SharedSlots slots(numbered(many), 1);
  const auto full = [](int done) {
    if (done > 5) throw Failure("the disk is full");
  };
  CHECK_THROWS_WITH_AS(run_tasks(slots, with(2, full), [](int, double*) { usleep(1000); }),
                       "the disk is full", Failure);
  CHECK(slots.finished() < many);
}

}  // namespace pendula::workers_test
