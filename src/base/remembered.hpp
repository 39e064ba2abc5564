// What outlives a call of the library and refers to expressions: how it is forgotten, and how it is known
// which expressions it refers to.
//
// Expressions have no owner. They are made in windows of time (Memory in expr/graph/graph.hpp), and a call
// can get hold of one in four ways only: it makes or asks for it, in the window of the call; it reads an
// object of Lua or a remembered answer, which knows its windows; or it goes on to operands. So the windows of
// what a call has read, and its own, are those of all that it makes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <memory>
#include <mutex>
#include <vector>

namespace pendula {

/// Numbers of windows, sorted; nullptr: none.
using Windows = std::shared_ptr<const std::vector<std::uint16_t>>;

/// The windows of what the running call has made and read so far.
class Origins {
 public:
  /// A call begins in this window.
  static void begin(std::uint16_t window) {
    if (own()->front() != window) own() = std::make_shared<std::vector<std::uint16_t>>(1, window);
    now() = own();
  }
  static const Windows& so_far() { return now(); }
  /// The call reads something of these windows. Cost: O(1) where nothing is new.
  static void add(const Windows& more) {
    if (!more || more == now() || std::ranges::includes(*now(), *more)) return;
    auto both = std::make_shared<std::vector<std::uint16_t>>();
    std::ranges::set_union(*now(), *more, std::back_inserter(*both));
    now() = std::move(both);
  }

 private:
  static Windows& now() {
    static Windows windows = own();
    return windows;
  }
  static Windows& own() {
    static Windows window = std::make_shared<std::vector<std::uint16_t>>(1, std::uint16_t{0});
    return window;
  }
};

/// What is remembered between calls: every cache derives from this.
class Remembered {
 public:
  Remembered(const Remembered&) : Remembered() {}
  Remembered& operator=(const Remembered&) { return *this; }

  /// Calls forget() of all that live. Requires that nobody is using one of them.
  static void forget_all() {
    List& all = list();
    const std::lock_guard lock(all.mutex);
    for (all.next = all.first; all.next;) {
      Remembered& one = *all.next;
      all.next = one.after_;
      one.forget();
    }
  }

 protected:
  Remembered() : after_(nullptr) {
    const std::lock_guard lock(list().mutex);
    after_ = list().first;
    if (after_) after_->before_ = this;
    list().first = this;
  }
  virtual ~Remembered() {
    List& all = list();
    const std::lock_guard lock(all.mutex);
    if (all.next == this) all.next = after_;
    if (after_) after_->before_ = before_;
    (before_ ? before_->after_ : all.first) = after_;
  }

 private:
  struct List {
    std::recursive_mutex mutex;  ///< what is forgotten may hold something remembered
    Remembered* first = nullptr;
    Remembered* next = nullptr;  ///< whose turn it is in forget_all()
  };
  /// Never destroyed: static caches leave it when the program ends.
  static List& list() {
    static List& all = *new List;
    return all;
  }

  virtual void forget() = 0;

  Remembered *before_ = nullptr, *after_;
};

}  // namespace pendula
