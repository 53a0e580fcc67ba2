// Orocos KDL: its recursive position solver and its Jacobian solver.
#include "peer.hpp"
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>

int main(int, char **arguments) {
    Peer peer(arguments[1]);
    KDL::Chain chain;
    // KDL's modified DH has its fixed part before the joint: a fixed segment, then a revolute one.
    for (int i = 0; i < 6; ++i) {
        chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), KDL::Frame::DH_Craig1989(A[i], ALPHA[i], D[i], 0.0)));
        chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), KDL::Frame::Identity()));
    }
    KDL::ChainFkSolverPos_recursive position(chain);
    KDL::ChainJntToJacSolver differential(chain);
    std::vector<KDL::JntArray> joints;
    for (auto &start : peer.starts) {
        joints.emplace_back(6);
        for (int i = 0; i < 6; ++i) joints.back()(i) = start[i];
    }
    KDL::Frame frame;
    KDL::Jacobian jacobian(6);
    peer.task("kinematics", [&](size_t i) { position.JntToCart(joints[i], frame); keep(frame); });
    peer.task("pose_jacobian", [&](size_t i) {
        position.JntToCart(joints[i], frame);
        differential.JntToJac(joints[i], jacobian);
        keep(jacobian);
    });
    peer.check = [&](size_t i) {
        position.JntToCart(joints[i], frame);
        differential.JntToJac(joints[i], jacobian);
        std::vector<double> numbers;
        for (int row = 0; row < 3; ++row) numbers.push_back(frame.p(row));
        for (double x : frame.M.data) numbers.push_back(x);
        for (int row : {3, 4, 5, 0, 1, 2})
            for (int column = 0; column < 6; ++column) numbers.push_back(jacobian(row, column));
        return numbers;
    };
    peer.answer();
}
