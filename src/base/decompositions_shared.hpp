// What Eigen's factorisations are made of, compiled once for the files decompositions_*.cpp: Householder's
// reflections, one by one and in blocks. Those of double are instantiated in decompositions_factors.cpp.
#pragma once

#include "base/decompositions.hpp"

#define PENDULA_REFLECTION(how, Part, Vector)                                                       \
  how void MatrixBase<Part>::applyHouseholderOnTheLeft<Vector>(const Vector&, const Part::Scalar&,  \
                                                               Part::Scalar*);                      \
  how void MatrixBase<Part>::applyHouseholderOnTheRight<Vector>(const Vector&, const Part::Scalar&, \
                                                                Part::Scalar*);

#define PENDULA_BLOCK_REFLECTION(how, Coefficients)                                   \
  how void make_block_householder_triangular_factor<ByRows, PartOfMat, Coefficients>( \
      ByRows&, const PartOfMat&, const Coefficients&);                                \
  how void apply_block_householder_on_the_left<PartOfMat, PartOfMat, Coefficients>(   \
      PartOfMat&, const PartOfMat&, const Coefficients&, bool);

#define PENDULA_TRIANGULAR_PRODUCT(how, mode, is_left, left_order)                                       \
  how struct product_triangular_matrix_matrix<double, Index, mode, is_left, left_order, false, ColMajor, \
                                              false, ColMajor, 1>;

#define PENDULA_REFLECTIONS(how)                   \
  PENDULA_REFLECTION(how, PartOfMat, StoredVector) \
  PENDULA_REFLECTION(how, PartOfMat, TailOfColumn) \
  how void HouseholderSequence<MatrixXd, VectorXd, 1>::evalTo<MatrixXd, VectorXd>(MatrixXd&, VectorXd&) const;

#define PENDULA_BLOCK_REFLECTIONS(how)                       \
  PENDULA_TRIANGULAR_PRODUCT(how, Upper, true, RowMajor)     \
  PENDULA_TRIANGULAR_PRODUCT(how, Lower, true, ColMajor)     \
  PENDULA_TRIANGULAR_PRODUCT(how, UnitUpper, true, RowMajor) \
  PENDULA_TRIANGULAR_PRODUCT(how, UnitLower, true, ColMajor) \
  PENDULA_BLOCK_REFLECTION(how, HeadOfVector)                \
  PENDULA_BLOCK_REFLECTION(how, PartOfVector)

namespace Eigen {

using PartOfMat = Block<MatrixXd, Dynamic, Dynamic, false>;
using StoredVector = Block<const MatrixXd, Dynamic, 1, false>;
using TailOfColumn = VectorBlock<Block<MatrixXd, Dynamic, 1, true>, Dynamic>;
using HeadOfVector = VectorBlock<const VectorXd, Dynamic>;
using PartOfVector = Block<const VectorXd, Dynamic, 1, false>;
using ByRows = Matrix<double, Dynamic, Dynamic, RowMajor>;

namespace internal {
PENDULA_BLOCK_REFLECTIONS(extern template)
}

PENDULA_REFLECTIONS(extern template)

}  // namespace Eigen
