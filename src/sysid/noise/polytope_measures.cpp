// Volume, inscribed ball and bounding intervals of a polytope, and the smallest noise bound for which an
// empty one becomes feasible.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "base/decompositions.hpp"
#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "sysid/noise/linear_program.hpp"
#include "sysid/noise/polytope.hpp"

namespace pendula::sysid {
namespace {

using VertexSet = std::vector<Index>;  ///< sorted

mpq_class determinant(std::vector<std::vector<mpq_class>> m) {
  mpq_class det = 1;
  for (std::size_t k = 0; k < m.size(); ++k) {
    std::size_t p = k;
    while (p < m.size() && m[p][k] == 0) ++p;
    if (p == m.size()) return 0;
    if (p != k) {
      std::swap(m[p], m[k]);
      det = -det;
    }
    det *= m[k][k];
    for (std::size_t i = k + 1; i < m.size(); ++i) {
      const mpq_class factor = m[i][k] / m[k][k];
      for (std::size_t j = k; j < m.size(); ++j) m[i][j] -= factor * m[k][j];
    }
  }
  return det;
}

/// The vertices on each facet.
std::vector<VertexSet> facets_of(const Polytope& p) {
  std::vector<std::pair<Index, Index>> incidence;
  for (std::size_t v = 0; v < p.active.size(); ++v)
    for (const Index c : p.active[v]) incidence.emplace_back(c, static_cast<Index>(v));
  std::sort(incidence.begin(), incidence.end());
  std::set<VertexSet> distinct;
  for (std::size_t i = 0; i < incidence.size();) {
    VertexSet on;
    const Index c = incidence[i].first;
    for (; i < incidence.size() && incidence[i].first == c; ++i) on.push_back(incidence[i].second);
    distinct.insert(std::move(on));
  }
  return {distinct.begin(), distinct.end()};
}

/// The facets of a facet: intersections with the others that have at least `dimension` vertices.
std::vector<VertexSet> facets_of_face(const VertexSet& face, const std::vector<VertexSet>& neighbours,
                                      Index dimension) {
  std::set<VertexSet> distinct;
  for (const VertexSet& other : neighbours) {
    VertexSet common;
    std::set_intersection(face.begin(), face.end(), other.begin(), other.end(), std::back_inserter(common));
    if (common.size() < face.size() && static_cast<Index>(common.size()) >= dimension && !common.empty())
      distinct.insert(std::move(common));
  }
  return {distinct.begin(), distinct.end()};
}

/// Splits a polytope into simplices with a common apex at every level and passes each to `visit` (d
/// + 1 vertices).
template <class Visit>
class Splitter {
 public:
  Splitter(const Polytope& p, Visit visit)
      : d_(p.vertices.cols()), visit_(std::move(visit)), facets_(facets_of(p)) {}

  void run(Index vertices) {
    VertexSet all(static_cast<std::size_t>(vertices));
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Index>(i);
    split(all, facets_, d_);
  }

 private:
  void split(const VertexSet& face, const std::vector<VertexSet>& facets, Index dimension) {
    if (++calls_ % 1024 == 0) poll_interrupt();
    apex_.push_back(face[0]);
    if (dimension == 0) {
      visit_(apex_);
    } else {
      for (const VertexSet& facet : facets) {
        if (facet[0] == face[0] || static_cast<Index>(facet.size()) < dimension) continue;
        split(facet, facets_of_face(facet, facets, dimension - 1), dimension - 1);
      }
    }
    apex_.pop_back();
  }

  Index d_;
  Visit visit_;
  std::vector<VertexSet> facets_;
  VertexSet apex_;
  long calls_ = 0;
};

/// Volumes of faces from those of their facets, V = Σ height · V(facet) / dimension over the facets that do
/// not contain the apex. Shared faces are computed once (Büeler, Enge & Fukuda, in: Polytopes – Combinatorics
/// and Computation, 2000, §3).
class FaceVolumes {
 public:
  explicit FaceVolumes(const Mat& vertices) : x_(vertices.transpose()) {}

  double of(const VertexSet& face, const std::vector<VertexSet>& facets, Index dimension) {
    if (dimension == 0) return 1;
    const auto known = volumes_.find(face);
    if (known != volumes_.end()) return known->second;
    if (volumes_.size() % 256 == 0) poll_interrupt();
    if (volumes_.size() > most_faces)
      throw Failure(text("the volume of a set with ", x_.cols(), " vertices in ", x_.rows(),
                         " parameters needs more than ", most_faces,
                         " faces; see set.box, or fewer parameters"));
    double sum = 0;
    for (const VertexSet& facet : facets) {
      if (facet[0] == face[0] || static_cast<Index>(facet.size()) < dimension) continue;
      sum += height(face[0], facet) * of(facet, facets_of_face(facet, facets, dimension - 1), dimension - 1);
    }
    return volumes_[face] = sum / static_cast<double>(dimension);
  }

 private:
  /// Distance of a vertex from the affine hull of a face.
  double height(Index apex, const VertexSet& face) const {
    Vec from = x_.col(apex) - x_.col(face[0]);
    if (face.size() == 1) return from.norm();
    Mat edges = x_(Eigen::all, VertexSet(face.begin() + 1, face.end()));
    edges.colwise() -= x_.col(face[0]);
    Eigen::ColPivHouseholderQR<Mat> qr;
    qr.setThreshold(1e-11);  // 45000 ε: edges of a face differ from its dimension by the rounding of vertices
    qr.compute(edges);
    const Vec turned = times_transposed(qr.householderQ(), from);
    return turned.tail(turned.size() - qr.rank()).norm();
  }

  static constexpr std::size_t most_faces = 400000;  // 130 MB if each has 30 vertices
  Mat x_;
  std::map<VertexSet, double> volumes_;
};

}  // namespace

double volume(const FeasibleSet& s, const Polytope& p) {
  const Index d = p.vertices.cols();
  if (p.vertices.rows() <= d) return 0;
  if (const auto simple = simple_volume(s, p)) return *simple;
  // scaled by the extents, so that ranks do not depend on the units of the parameters
  const Vec low = p.vertices.colwise().minCoeff();
  Vec size = p.vertices.colwise().maxCoeff().transpose() - low;
  if (!(size.minCoeff() > 0)) return 0;
  const Mat scaled = (p.vertices.rowwise() - low.transpose()) * size.cwiseInverse().asDiagonal();
  VertexSet all(static_cast<std::size_t>(p.vertices.rows()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Index>(i);
  return size.prod() * FaceVolumes(scaled).of(all, facets_of(p), d);
}

mpq_class exact_volume(const Polytope& p) {
  const auto d = static_cast<std::size_t>(p.vertices.cols());
  if (p.exact.size() <= d) return 0;
  mpq_class sum = 0;
  const auto add = [&](const VertexSet& s) {
    std::vector<std::vector<mpq_class>> edges(d, std::vector<mpq_class>(d));
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t j = 0; j < d; ++j) edges[i][j] = p.exact[s[i + 1]][j] - p.exact[s[0]][j];
    sum += abs(determinant(std::move(edges)));
  };
  Splitter(p, add).run(p.vertices.rows());
  for (std::size_t i = 2; i <= d; ++i) sum /= static_cast<unsigned long>(i);
  return sum;
}

Ball largest_ball(const FeasibleSet& s, const Polytope& p) {
  const Index d = s.Phi.cols();
  std::set<Index> facets;
  for (const auto& set : p.active) facets.insert(set.begin(), set.end());
  // centred at the mean of the vertices and scaled by their extent, so that the program is well scaled
  const Vec middle = p.vertices.colwise().mean();
  const Vec size = (p.vertices.rowwise() - middle.transpose())
                       .cwiseAbs()
                       .colwise()
                       .maxCoeff()
                       .transpose()
                       .cwiseMax(least_size);
  const double least = size.minCoeff();
  LinearProgram lp;
  lp.c = -Vec::Unit(d + 1, d);
  lp.G.resize(static_cast<Index>(facets.size()), d + 1);
  lp.h.resize(lp.G.rows());
  Index i = 0;
  for (const Index c : facets) {
    const double sign = c % 2 ? 1 : -1;
    const Vec g = sign * s.Phi.row(c / 2).transpose();
    const double h = sign * (c % 2 ? s.upper : s.lower)[c / 2];
    lp.G.row(i) << g.cwiseProduct(size).transpose(), g.norm() * least;
    const double scale = lp.G.row(i).norm();
    lp.G.row(i) /= scale;
    lp.h[i++] = (h - g.dot(middle)) / scale;
  }
  const LinearSolution best = solve(lp);
  return {middle + size.cwiseProduct(best.x.head(d)), std::max(0.0, least * best.x[d])};
}

SmallestBound smallest_bound(const Mat& Phi, const Vec& mid) {
  const Index d = Phi.cols(), N = Phi.rows();
  Vec scale = Phi.colwise().norm();
  for (double& size : scale)
    if (size == 0) size = 1;  // a parameter that occurs in no row
  LinearProgram lp;
  lp.c = Vec::Unit(d + 1, d);
  lp.G.resize(2 * N, d + 1);
  lp.h.resize(2 * N);
  const double size = std::max(mid.cwiseAbs().maxCoeff(), least_size);
  for (Index t = 0; t < N; ++t) {
    const Eigen::RowVectorXd phi = Phi.row(t).cwiseQuotient(scale.transpose());
    lp.G.row(2 * t) << phi, -1;
    lp.G.row(2 * t + 1) << -phi, -1;
    lp.h[2 * t] = mid[t] / size;
    lp.h[2 * t + 1] = -mid[t] / size;
  }
  const LinearSolution best = solve(lp);
  SmallestBound out;
  out.bound = std::max(0.0, size * best.x[d]);
  out.theta = size * best.x.head(d).cwiseQuotient(scale);
  constexpr double zero = 1e-10;  // multipliers sum to 1; those of rows that do not decide are rounding
  for (std::size_t i = 0; i < best.active.size(); ++i)
    if (best.active[i] < 2 * N && best.multipliers[i] > zero) out.rows.push_back(best.active[i] / 2);
  std::sort(out.rows.begin(), out.rows.end());
  out.rows.erase(std::unique(out.rows.begin(), out.rows.end()), out.rows.end());
  return out;
}

Mat intervals(const FeasibleSet& s) {
  const Index d = s.Phi.cols(), N = s.Phi.rows();
  Mat box(d, 2);
  const Vec scale = s.Phi.colwise().norm();
  LinearProgram lp;
  lp.G.resize(2 * N, d);
  lp.h.resize(2 * N);
  for (Index t = 0; t < N; ++t) {
    for (Index j = 0; j < d; ++j) lp.G(2 * t, j) = scale[j] > 0 ? s.Phi(t, j) / scale[j] : 0;
    lp.G.row(2 * t + 1) = -lp.G.row(2 * t);
    lp.h[2 * t] = s.upper[t];
    lp.h[2 * t + 1] = -s.lower[t];
  }
  for (Index i = 0; i < d; ++i)
    for (const Index side : {0, 1}) {
      const double sign = side == 0 ? 1 : -1;
      lp.c = sign * Vec::Unit(d, i);
      const LinearSolution best = scale[i] > 0 ? solve(lp) : LinearSolution{};
      const bool bounded = scale[i] > 0 && best.status == LinearSolution::Status::optimal;
      box(i, side) = bounded ? best.x[i] / scale[i] : -sign * std::numeric_limits<double>::infinity();
    }
  return box;
}

}  // namespace pendula::sysid
