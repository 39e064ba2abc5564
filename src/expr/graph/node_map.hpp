// A value for every node of the graph that a pass touches.
//
// Values live in pages of neighbouring nodes, made when a pass first reaches them: what a pass costs depends
// on the nodes it touches, never on how many expressions a session has made. Forgetting everything is O(1);
// pages that long have not been reached are given back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula {

/// A sparse map from Expr to T with O(1) access and reset. References stay valid until clear().
template <class T>
class NodeMap {
 public:
  void clear() {
    idle_ = held_ > 2 * reached_ + few ? idle_ + 1 : 0;
    if (idle_ == patience) release();
    reached_ = 0;
    ++round_;
  }

  bool has(Expr e) const {
    const std::size_t k = e.id() / size;
    return k < pages_.size() && pages_[k] && pages_[k]->rounds[e.id() % size] == round_;
  }

  T& operator[](Expr e) {
    const std::size_t k = e.id() / size, i = e.id() % size;
    if (k >= pages_.size()) pages_.resize(k + k / 2 + 1);
    if (!pages_[k]) {
      pages_[k] = std::make_unique<Page>();
      ++held_;
    }
    Page& page = *pages_[k];
    if (page.rounds[i] != round_) {
      page.rounds[i] = round_;
      page.values[i] = T();
      reached_ += page.last != round_;
      page.last = round_;
    }
    return page.values[i];
  }

 private:
  /// Nodes of a page: small expressions touch one, which is 3 to 6 KB
  static constexpr std::size_t size = 256;
  static constexpr std::size_t few = 64;  ///< pages that are kept in any case, some 0.3 MB
  static constexpr int patience = 64;     // rounds; a pass over everything now and then keeps its pages

  struct Page {
    std::uint32_t last = 0;  ///< the round that has reached it
    std::array<std::uint32_t, size> rounds{};
    std::array<T, size> values{};
  };

  void release() {
    for (auto& page : pages_)
      if (page && page->last != round_) {
        page.reset();
        --held_;
      }
    idle_ = 0;
  }

  std::vector<std::unique_ptr<Page>> pages_;
  std::size_t held_ = 0, reached_ = 0;  ///< pages; of them reached in this round
  std::uint32_t round_ = 1;
  int idle_ = 0;  ///< rounds in a row that have reached less than half of the pages
};

}  // namespace pendula
