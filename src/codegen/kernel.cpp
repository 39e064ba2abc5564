// Kernels: what is compiled once is remembered by the expressions it computes.
#include "codegen/kernel.hpp"

#include <list>
#include <mutex>
#include <unordered_map>

#include "base/error.hpp"
#include "codegen/hot.hpp"
#include "codegen/tape.hpp"

namespace pendula::codegen {

struct Kernel::Code {
  Tape tape;
  Hot hot;
  explicit Code(Program program) : tape(program), hot(std::move(program)) {}
};

namespace {

/// The ids of outputs and inputs: nodes are never changed or freed, so equal ids mean the same function.
using Key = std::vector<std::uint32_t>;
struct KeyHash {
  std::size_t operator()(const Key& key) const {
    std::size_t h = 1469598103934665603ULL;  // FNV-1a over words
    for (std::uint32_t id : key) h = (h ^ id) * 1099511628211ULL;
    return h;
  }
};

/// The most recently used, up to a total size.
template <class Value>
class Memory {
 public:
  std::shared_ptr<Value> find(const Key& key) {
    const auto at = where_.find(key);
    if (at == where_.end()) return nullptr;
    items_.splice(items_.begin(), items_, at->second);
    return at->second->value;
  }
  void add(const Key& key, std::shared_ptr<Value> value, std::size_t size) {
    constexpr std::size_t most = 1'000'000;  // instructions: some 60 MB
    items_.push_front({key, std::move(value), size + key.size()});
    where_[key] = items_.begin();
    total_ += items_.front().size;
    while (total_ > most && items_.size() > 1) {
      total_ -= items_.back().size;
      where_.erase(items_.back().key);
      items_.pop_back();
    }
  }

 private:
  struct Item {
    Key key;
    std::shared_ptr<Value> value;
    std::size_t size;
  };
  std::list<Item> items_;
  std::unordered_map<Key, typename std::list<Item>::iterator, KeyHash> where_;
  std::size_t total_ = 0;
};

}  // namespace

Kernel::Kernel(std::span<const Expr> outputs, std::span<const Expr> inputs) {
  static Memory<Code> memory;
  static std::mutex mutex;
  Key key;
  key.reserve(outputs.size() + inputs.size() + 1);
  for (Expr e : inputs) key.push_back(e.id());
  key.push_back(static_cast<std::uint32_t>(inputs.size()));
  for (Expr e : outputs) key.push_back(e.id());
  const std::lock_guard lock(mutex);
  code_ = memory.find(key);
  if (!code_) {
    code_ = std::make_shared<Code>(lower(outputs, inputs));
    memory.add(key, code_, code_->tape.operations());
  }
  input_count_ = inputs.size(), output_count_ = outputs.size(), slots_ = code_->tape.workspace_size();
}

std::size_t Kernel::operations() const { return code_ ? code_->tape.operations() : 0; }

double* Kernel::work() const {
  work_.resize(slots_);
  return work_.data();
}

std::vector<double> Kernel::operator()(std::span<const double> in) const {
  PENDULA_ASSERT(in.size() == input_count_, "a kernel got the wrong number of inputs");
  std::vector<double> out(outputs());
  (*this)(in.data(), out.data());
  return out;
}

void Kernel::run(const double* in, double* out, double* w) const {
  if (!code_) return;
  if (const Machine* machine = code_->hot.code())
    machine->run(in, out, w);
  else
    code_->tape.run(in, out, w);
}

void Kernel::run_tape(const double* in, double* out, double* w) const {
  if (code_) code_->tape.run(in, out, w);
}

bool Kernel::accelerate() const { return code_ && code_->hot.compile(); }
bool Kernel::is_machine_code() const { return code_ && code_->hot.made(); }

void Kernel::run_many(const double* in, double* out, std::size_t points) const {
  constexpr std::size_t lanes = 4, worth_it = 64;
  const std::size_t n = inputs(), m = outputs();
  const Machine* machine = code_ && points >= worth_it ? code_->hot.lanes() : nullptr;
  std::size_t done = 0;
  if (machine) {
    std::vector<double> x(lanes * n), y(lanes * m), work(machine->workspace_size());
    for (; done + lanes <= points; done += lanes) {
      for (std::size_t lane = 0; lane < lanes; ++lane)
        for (std::size_t k = 0; k < n; ++k) x[lanes * k + lane] = in[(done + lane) * n + k];
      machine->run(x.data(), y.data(), work.data());
      for (std::size_t lane = 0; lane < lanes; ++lane)
        for (std::size_t k = 0; k < m; ++k) out[(done + lane) * m + k] = y[lanes * k + lane];
    }
  }
  std::vector<double> work(workspace_size());
  for (; done < points; ++done) run(in + done * n, out + done * m, work.data());
}

}  // namespace pendula::codegen
