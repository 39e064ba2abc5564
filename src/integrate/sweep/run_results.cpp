#include "integrate/sweep/run_results.hpp"

namespace pendula::integrate {
namespace {

class InMemory : public RunResults {
 public:
  InMemory(std::shared_ptr<const SharedSlots> slots, std::size_t width)
      : slots_(std::move(slots)), width_(width) {}
  State state(int run) const override {
    switch (slots_->state(run)) {
      case SharedSlots::State::done:
        return State::done;
      case SharedSlots::State::failed:
        return State::failed;
      default:
        return State::waiting;
    }
  }
  std::string failure(int run) const override {
    return state(run) == State::failed ? slots_->failure(run) : "not run: interrupted";
  }
  std::vector<int> failures() const override {
    std::vector<int> result;
    for (int run = 0; run < slots_->tasks(); ++run)
      if (state(run) != State::done) result.push_back(run);
    return result;
  }
  void visit(std::size_t place, const Visitor& visitor) const override {
    for (int run = 0; run < slots_->tasks(); ++run) {
      if (state(run) != State::done) continue;
      const double* numbers = slots_->numbers(run);
      visitor(run, numbers, numbers + store::Record::head + place * width_);
    }
  }

 private:
  std::shared_ptr<const SharedSlots> slots_;
  std::size_t width_;
};

class Stored : public RunResults {
 public:
  explicit Stored(std::shared_ptr<const store::RunStore> store) : store_(std::move(store)) {}
  State state(int run) const override {
    switch (store_->state(run)) {
      case store::RunStore::State::done:
        return State::done;
      case store::RunStore::State::failed:
        return State::failed;
      default:
        return State::waiting;
    }
  }
  std::string failure(int run) const override { return store_->failure(run); }
  std::vector<int> failures() const override {
    const std::vector<long> failed = store_->failed();
    return {failed.begin(), failed.end()};
  }
  void visit(std::size_t place, const Visitor& visitor) const override {
    store_->visit(place, [&](long run, const double* head, const double* leaves) {
      visitor(static_cast<int>(run), head, leaves);
    });
  }

 private:
  std::shared_ptr<const store::RunStore> store_;
};

}  // namespace

std::shared_ptr<const RunResults> results_in(std::shared_ptr<const SharedSlots> slots, std::size_t width) {
  return std::make_shared<const InMemory>(std::move(slots), width);
}

std::shared_ptr<const RunResults> results_in(std::shared_ptr<const store::RunStore> store) {
  return std::make_shared<const Stored>(std::move(store));
}

}  // namespace pendula::integrate
