// The common part of the C++ peers: inputs, and answers to the requests of measure.py.
#pragma once
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

using Joints = std::array<double, 6>;

// The PUMA 560 of msg_config/puma560.yaml, modified DH.
constexpr double HALF_PI = 1.57079632679489661923;
constexpr double ALPHA[6] = {0, -HALF_PI, 0, -HALF_PI, HALF_PI, -HALF_PI};
constexpr double A[6] = {0, 0, 0.4318, 0.019, 0, 0};
constexpr double D[6] = {0, 0, 0.125, 0.432, 0, 0};

struct Peer {
    std::vector<Joints> starts, goals;
    std::map<std::string, std::function<void(size_t, size_t)>> tasks;
    std::function<std::vector<double>(size_t)> check;

    explicit Peer(const char *inputs) {
        std::ifstream file(inputs);
        std::array<double, 12> row;
        while ([&] {
            for (double &x : row)
                if (!(file >> x)) return false;
            return true;
        }()) {
            Joints start, goal;
            std::copy(row.begin(), row.begin() + 6, start.begin());
            std::copy(row.begin() + 6, row.end(), goal.begin());
            starts.push_back(start);
            goals.push_back(goal);
        }
    }

    // `each` is compiled into the loop, so that a call through a pointer is needed per slice only, not per configuration.
    template <class F> void task(const std::string &name, F each) {
        tasks[name] = [each](size_t first, size_t last) mutable {
            for (size_t i = first; i < last; ++i) each(i);
        };
    }

    // Each slice counts by its shortest time, so that interruptions do not count.
    double measure(std::function<void(size_t, size_t)> &task) {
        const size_t rounds = 4, slice = 64;
        double sum = 0;
        for (size_t first = 0; first < starts.size(); first += slice) {
            double shortest = 1e300;
            for (size_t round = 0; round < rounds; ++round) {
                auto begin = std::chrono::steady_clock::now();
                task(first, std::min(first + slice, starts.size()));
                std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
                shortest = std::min(shortest, spent.count());
            }
            sum += shortest;
        }
        return sum / starts.size();
    }

    void answer() {
        std::string question;
        while (std::getline(std::cin, question)) {
            if (question == "tasks") {
                for (auto &task : tasks) std::printf("%s ", task.first.c_str());
            } else if (question == "check") {
                for (size_t i = 0; i < starts.size(); ++i)
                    for (double x : check(i)) std::printf("%.17g ", x);
            } else {
                std::printf("%.3f", measure(tasks.at(question)));
            }
            std::printf("\n");
            std::fflush(stdout);
        }
    }
};

// Keeps the compiler from removing unused results.
template <class T> inline void keep(T &value) { asm volatile("" : : "r"(&value) : "memory"); }
