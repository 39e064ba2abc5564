// Worker processes: every task is done once, failures and dead workers are told apart, an interrupt keeps
// what is done.
#include "integrate/sweep/workers.hpp"

#include <atomic>
#include <cmath>

#include <doctest/doctest.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"

using namespace pendula;
using namespace pendula::integrate;
using State = SharedSlots::State;

TEST_CASE("workers: all tasks are done once, with the numbers of their own slot") {
  for (int workers : {1, 2, 5}) {
    CAPTURE(workers);
    SharedSlots slots(100, 3);
    const bool complete = run_tasks(slots, workers,
                                    [](int task, double* numbers) {
                                      numbers[0] += task;  // a second run of the task would show
                                      numbers[1] = std::sqrt(task);
                                      numbers[2] = -1;
                                    },
                                    {});
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
  SharedSlots slots(20, 1);
  run_tasks(slots, 3,
            [](int task, double*) {
              if (task == 7) throw Failure("step 7 ‖r‖");
              if (task == 8) {
                std::string text;
                for (int i = 0; i < 300; ++i) text += "‖";
                throw Error(text);
              }
            },
            {});
  CHECK(slots.state(7) == State::failed);
  CHECK(slots.failure(7) == "step 7 ‖r‖");
  CHECK(slots.failure(8).size() % 3 == 0);
  CHECK(slots.failure(8).size() > 450);
  CHECK(slots.state(9) == State::done);
}

TEST_CASE("workers: a process that dies fails its task, the others go on") {
  SharedSlots slots(40, 1);
  const auto parent = getpid();
  const bool complete = run_tasks(slots, 2,
                                  [parent](int task, double* numbers) {
                                    if (task == 3 && getpid() != parent) _exit(9);
                                    numbers[0] = 1;
                                  },
                                  {});
  CHECK(complete);
  CHECK(slots.state(3) == State::failed);
  CHECK(slots.failure(3) == "its worker process ended unexpectedly");
  for (int i = 0; i < 40; ++i)
    if (i != 3) CHECK(slots.numbers(i)[0] == 1);
}

TEST_CASE("workers: an interrupt stops, what is done stays done") {
  for (int workers : {1, 2}) {
    CAPTURE(workers);
    SharedSlots slots(1000, 1);
    std::atomic<bool> asked = false;
    const bool complete = run_tasks(
        slots, workers,
        [](int, double* numbers) {
          numbers[0] = 1;
          usleep(1000);
        },
        [&](int done) {
          if (done > 10 && !asked.exchange(true)) interrupt_requested = true;
        });
    interrupt_requested = false;
    CHECK_FALSE(complete);
    CHECK(slots.finished() > 10);
    CHECK(slots.finished() < 1000);
  }
}
