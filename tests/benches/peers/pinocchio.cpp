// Pinocchio: joint placements, the frame's Jacobian, and logc with its logarithm and a Cholesky decomposition of fixed size.
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/spatial.hpp>
#include "peer.hpp"

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

int main(int, char **arguments) {
    Peer peer(arguments[1]);
    pinocchio::Model model;
    pinocchio::JointIndex last = 0;
    for (int i = 0; i < 6; ++i) {
        const Eigen::Matrix3d turn = Eigen::AngleAxisd(ALPHA[i], Eigen::Vector3d::UnitX()).toRotationMatrix();
        const pinocchio::SE3 before(turn, turn * Eigen::Vector3d(A[i], 0, D[i]));
        last = model.addJoint(last, pinocchio::JointModelRZ(), before, "joint" + std::to_string(i));
    }
    pinocchio::Data data(model);
    auto vectors = [](const std::vector<Joints> &all) {
        std::vector<Eigen::VectorXd> vectors;
        for (auto &joints : all) vectors.push_back(Eigen::Map<const Vector6>(joints.data()));
        return vectors;
    };
    const auto starts = vectors(peer.starts);
    std::vector<pinocchio::SE3> goals;
    for (auto &goal : vectors(peer.goals)) {
        pinocchio::forwardKinematics(model, data, goal);
        goals.push_back(data.oMi[last]);
    }
    Matrix6 jacobian = Matrix6::Zero();
    peer.task("kinematics", [&](size_t i) { pinocchio::forwardKinematics(model, data, starts[i]); keep(data.oMi[last]); });
    peer.task("pose_jacobian", [&](size_t i) {
        pinocchio::computeJointJacobian(model, data, starts[i], last, jacobian);
        keep(jacobian);
    });
    Vector6 speeds;
    peer.task("logc", [&](size_t i) {
        pinocchio::computeJointJacobian(model, data, starts[i], last, jacobian);
        const Vector6 error = pinocchio::log6(data.oMi[last].actInv(goals[i])).toVector();
        Matrix6 gram = jacobian * jacobian.transpose();
        gram.diagonal().array() += 0.05 * 0.05;
        speeds.noalias() = jacobian.transpose() * gram.llt().solve(error);
        keep(speeds);
    });
    peer.check = [&](size_t i) {
        pinocchio::computeJointJacobians(model, data, starts[i]);
        Eigen::Matrix<double, 6, Eigen::Dynamic> wide = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, 6);
        pinocchio::getJointJacobian(model, data, last, pinocchio::LOCAL_WORLD_ALIGNED, wide);
        std::vector<double> numbers;
        for (int row = 0; row < 3; ++row) numbers.push_back(data.oMi[last].translation()[row]);
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) numbers.push_back(data.oMi[last].rotation()(row, column));
        for (int row : {3, 4, 5, 0, 1, 2})
            for (int column = 0; column < 6; ++column) numbers.push_back(wide(row, column));
        return numbers;
    };
    peer.answer();
}
