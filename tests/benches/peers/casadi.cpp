// CasADi: the C code that casadi_laws.py generated with it, including this arm's constants.
#include "laws.h"
#include "peer.hpp"

using Function = int (*)(const double **, double **, long long *, double *, int);

int main(int, char **arguments) {
    Peer peer(arguments[1]);
    std::vector<std::array<double, 8>> poses(peer.goals.size());
    auto call = [](Function function, const double *joints, const double *goal, double *result) {
        const double *inputs[] = {joints, goal};
        double *results[] = {result};
        function(inputs, results, nullptr, nullptr, 0);
    };
    std::array<double, 48> result{};
    for (size_t i = 0; i < poses.size(); ++i) {
        call(kinematics, peer.goals[i].data(), poses[i].data(), poses[i].data());
        call(kinematics, peer.starts[i].data(), poses[i].data(), result.data());
        double cosine = 0;
        for (int k = 0; k < 4; ++k) cosine += poses[i][k] * result[k];
        if (cosine < 0)
            for (double &x : poses[i]) x = -x;
    }
    auto add = [&](const char *name, Function function) {
        peer.task(name, [&, function](size_t i) {
            call(function, peer.starts[i].data(), poses[i].data(), result.data());
            keep(result);
        });
    };
    add("kinematics", kinematics);
    add("pose_jacobian", pose_jacobian);
    add("diffc", diffc);
    add("unit_quaternion", unit_quaternion);
    add("logc", logc);
    peer.check = [&](size_t i) {
        std::vector<double> numbers(56);
        call(kinematics, peer.starts[i].data(), poses[i].data(), numbers.data());
        call(pose_jacobian, peer.starts[i].data(), poses[i].data(), numbers.data() + 8);
        return numbers;
    };
    peer.answer();
}
