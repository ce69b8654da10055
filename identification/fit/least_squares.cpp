#include "identification/fit/least_squares.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace identification::fit {
namespace {

/// Evaluates all residuals at once for Ceres, which requests them one by one to apply the loss.
class Evaluation : public ceres::EvaluationCallback {
 public:
  Evaluation(const LeastSquaresProblem& problem, const Eigen::VectorXd& parameters)
      : problem_(problem),
        parameters_(parameters),
        residuals_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.residuals))),
        side_(residuals_),
        jacobian_(residuals_.size(), parameters.size()) {}

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override {
    if (new_evaluation_point) have_jacobian_ = false;
    problem_.evaluate(parameters_, residuals_);
    if (evaluate_jacobians && !have_jacobian_) differentiate();
  }

  void differentiate() {
    Eigen::VectorXd moved = parameters_;
    for (Eigen::Index k = 0; k < moved.size(); ++k) {
      // Central differences: error of order h², rounding of order 1e-16/h.
      const double h = 1e-5 * std::max(std::abs(parameters_[k]), problem_.scale[k]);
      const double above = std::min(parameters_[k] + h, problem_.upper[k]);
      const double below = std::max(parameters_[k] - h, problem_.lower[k]);
      moved[k] = above;
      problem_.evaluate(moved, side_);
      jacobian_.col(k) = side_;
      moved[k] = below;
      problem_.evaluate(moved, side_);
      jacobian_.col(k) -= side_;
      jacobian_.col(k) /= above > below ? above - below : 1;
      moved[k] = parameters_[k];
    }
    have_jacobian_ = true;
  }

  const Eigen::VectorXd& residuals() const { return residuals_; }
  const Eigen::MatrixXd& jacobian() const { return jacobian_; }

 private:
  const LeastSquaresProblem& problem_;
  const Eigen::VectorXd& parameters_;  // where Ceres moves them
  Eigen::VectorXd residuals_;
  Eigen::VectorXd side_;
  Eigen::MatrixXd jacobian_;
  bool have_jacobian_ = false;
};

class Row : public ceres::CostFunction {
 public:
  Row(const Evaluation& evaluation, Eigen::Index index, int parameters)
      : evaluation_(evaluation), index_(index) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(parameters);
  }
  bool Evaluate(double const* const* /*parameters*/, double* residual, double** jacobians) const override {
    *residual = evaluation_.residuals()[index_];
    if (jacobians != nullptr && jacobians[0] != nullptr)
      for (Eigen::Index k = 0; k < evaluation_.jacobian().cols(); ++k)
        jacobians[0][k] = evaluation_.jacobian()(index_, k);
    return std::isfinite(*residual);
  }

 private:
  const Evaluation& evaluation_;
  Eigen::Index index_;
};

LeastSquaresSolution minimise_from(const LeastSquaresProblem& problem, const Eigen::VectorXd& start) {
  LeastSquaresSolution solution;
  solution.parameters = start.cwiseMax(problem.lower).cwiseMin(problem.upper);
  Evaluation evaluation(problem, solution.parameters);
  const int count = static_cast<int>(start.size());
  if (count == 0) {
    evaluation.PrepareForEvaluation(false, true);
    solution.residuals = evaluation.residuals();
    solution.jacobian = evaluation.jacobian();
    solution.cost = 0.5 * solution.residuals.squaredNorm();
    solution.converged = true;
    return solution;
  }
  ceres::Problem::Options ownership;
  ownership.evaluation_callback = &evaluation;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  std::unique_ptr<ceres::LossFunction> loss;
  if (problem.huber > 0) loss = std::make_unique<ceres::HuberLoss>(problem.huber);
  ceres::Problem ceres_problem(ownership);
  double* const block = solution.parameters.data();
  ceres_problem.AddParameterBlock(block, count);
  for (int k = 0; k < count; ++k) {
    ceres_problem.SetParameterLowerBound(block, k, problem.lower[k]);
    ceres_problem.SetParameterUpperBound(block, k, problem.upper[k]);
  }
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(problem.residuals); ++i)
    ceres_problem.AddResidualBlock(new Row(evaluation, i, count), loss.get(), block);

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = problem.max_iterations;
  options.function_tolerance = problem.tolerance;
  options.parameter_tolerance = 1e-10;
  options.gradient_tolerance = 1e-14;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  solution.cost = summary.final_cost;
  evaluation.PrepareForEvaluation(true, true);
  solution.residuals = evaluation.residuals();
  solution.jacobian = evaluation.jacobian();
  return solution;
}

}  // namespace

LeastSquaresSolution minimise(const LeastSquaresProblem& problem,
                              const std::vector<Eigen::VectorXd>& starts) {
  if (starts.empty()) throw std::invalid_argument("least squares: no starting point");
  LeastSquaresSolution best;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    LeastSquaresSolution found = minimise_from(problem, starts[i]);
    if (i == 0 || found.cost < best.cost) best = std::move(found);
  }
  return best;
}

}  // namespace identification::fit
