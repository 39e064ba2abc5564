#include "random/sample_space.hpp"

#include <algorithm>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "random/special.hpp"

namespace pendula::random {

SampleSpace::SampleSpace(std::vector<Column> columns, bool grid, std::optional<DesignRequest> design)
    : columns_(std::move(columns)), grid_(grid) {
  if (columns_.empty())
    throw Error(
        "nothing varies: give lists, for example params = { m = linspace(1, 2, 10) } or start = { x = {1, 2, 3} }, "
        "or distributions, params = { m = normal(1, 0.1) } with runs = 1000");
  const bool drawn = std::any_of(columns_.begin(), columns_.end(), [](const Column& c) { return c.drawn(); });
  if (drawn) {
    if (grid_)
      throw Error("grid = true combines lists; for distributions write design = \"grid\" with levels = 5");
    lay_out(design.value_or(DesignRequest()));
  } else if (design) {
    throw Error(
        "design, runs, seed, levels and scramble are for distributions such as params = { m = normal(1, 0.1) }, "
        "but all that varies are lists");
  } else {
    grid_ ? combine() : pair();
  }
}

void SampleSpace::combine() {
  for (const Column& column : columns_) {
    runs_ *= static_cast<long>(column.list.size());
    if (runs_ > most_runs) throw Error("more than 10 000 000 combinations; give shorter lists");
  }
}

void SampleSpace::pair() {
  const Column* longest = &columns_[0];
  for (const Column& column : columns_)
    if (column.list.size() > longest->list.size()) longest = &column;
  for (const Column& column : columns_)
    if (column.list.size() != 1 && column.list.size() != longest->list.size())
      throw Error(text("the lists are paired, but ", column.name, " has ", column.list.size(), " values and ",
                       longest->name, " has ", longest->list.size(),
                       "; give lists of one length, or grid = true for all combinations"));
  runs_ = static_cast<long>(longest->list.size());
  if (runs_ > most_runs) throw Error("more than 10 000 000 runs; give shorter lists");
}

void SampleSpace::lay_out(DesignRequest request) {
  std::vector<std::pair<const JointNormal*, int>> joints;
  int dimensions = 0;
  for (const Column& column : columns_) {
    const auto known = std::find_if(joints.begin(), joints.end(),
                                    [&](const auto& joint) { return joint.first == column.joint.get(); });
    if (column.joint && known != joints.end()) {
      dimension_.push_back(known->second);
      continue;
    }
    if (column.joint) joints.emplace_back(column.joint.get(), dimensions);
    dimension_.push_back(dimensions);
    dimensions += column.joint ? column.joint->size() : column.distribution ? 1 : 0;
  }
  request.dimensions = dimensions;
  design_.emplace(request);
  runs_ = design_->runs();
  for (const Column& column : columns_)
    if (!column.drawn() && column.list.size() != 1 && static_cast<long>(column.list.size()) != runs_)
      throw Error(text(column.name, " is a list of ", column.list.size(),
                       " values, and the distributions have ", runs_,
                       " runs; give a list of that length, or discrete{…} to draw from the values"));
}

std::size_t SampleSpace::place(std::size_t column, long run) const {
  const auto size = [&](std::size_t c) { return static_cast<long>(columns_[c].list.size()); };
  if (!grid_) return size(column) == 1 ? 0 : static_cast<std::size_t>(run);
  for (std::size_t c = columns_.size() - 1; c > column; --c) run /= size(c);
  return static_cast<std::size_t>(run % size(column));
}

double SampleSpace::value(std::size_t column, long run) const {
  const Column& c = columns_[column];
  if (!c.drawn()) return c.list[place(column, run)];
  constexpr double least = eps / 4;  // unscrambled sequences begin at 0, where quantiles may be infinite
  const auto unit = [&](int dimension) { return std::max(design_->unit(run, dimension), least); };
  if (c.distribution) return c.distribution->quantile(unit(dimension_[column]));
  std::vector<double> z;
  for (int j = 0; j <= c.component; ++j) z.push_back(normal_quantile(unit(dimension_[column] + j)));
  return c.joint->component(c.component, z.data());
}

}  // namespace pendula::random
