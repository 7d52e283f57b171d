// SPDX-License-Identifier: Apache-2.0
#include "offload/body/shape_space.h"

#include <Eigen/Dense>

namespace gyre {

ShapeSpace principal_components(const Eigen::MatrixXf& samples, const Eigen::VectorXd& weight, int count) {
  const Eigen::Index n = samples.rows();
  ShapeSpace space;
  space.mean = samples.cast<double>().colwise().mean().transpose();
  Eigen::RowVectorXf root(samples.cols());
  for (Eigen::Index c = 0; c < samples.cols(); ++c) root[c] = static_cast<float>(std::sqrt(weight[c / 3]));
  const Eigen::MatrixXf deviations = samples.rowwise() - space.mean.transpose().cast<float>();
  const Eigen::MatrixXf weighted = deviations.array().rowwise() * root.array();
  const Eigen::MatrixXd gram = (weighted * weighted.transpose()).cast<double>() / static_cast<double>(n - 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram);
  space.components.resize(samples.cols(), count);
  space.explained.resize(count);
  for (int k = 0; k < count; ++k) {
    const Eigen::Index at = n - 1 - k;
    // A sample's coordinate along component k is sqrt(n - 1) times its entry in the eigenvector, in standard
    // deviations, so the deviations' mean along the eigenvector is the component of one standard deviation.
    const Eigen::VectorXf coordinate = (eigen.eigenvectors().col(at) / std::sqrt(double(n - 1))).cast<float>();
    Eigen::VectorXd component = (deviations.transpose() * coordinate).cast<double>();
    Eigen::Index largest = 0;
    component.cwiseAbs().maxCoeff(&largest);
    if (component[largest] < 0) component = -component;
    space.components.col(k) = component;
    space.explained[k] = eigen.eigenvalues()[at] / gram.trace();
  }
  return space;
}

Eigen::VectorXd reconstruction_errors(const ShapeSpace& space, const Eigen::MatrixXf& samples,
                                      const Eigen::VectorXd& weight, int count) {
  const Eigen::MatrixXd components = space.components.leftCols(count);
  const Eigen::VectorXd each = weight.replicate(1, 3).transpose().reshaped();
  const Eigen::MatrixXd weighted = each.asDiagonal() * components;
  const Eigen::LDLT<Eigen::MatrixXd> normal(components.transpose() * weighted);
  Eigen::VectorXd errors(samples.rows());
  for (Eigen::Index s = 0; s < samples.rows(); ++s) {
    const Eigen::VectorXd deviation = samples.row(s).transpose().cast<double>() - space.mean;
    const Eigen::VectorXd rest = deviation - components * normal.solve(weighted.transpose() * deviation);
    errors[s] = rest.reshaped(3, weight.size()).colwise().norm().dot(weight) / weight.sum();
  }
  return errors;
}

}  // namespace gyre
