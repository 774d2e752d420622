// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace palpate::internal {

/// What a loop runs with, and what is to take its place, handed over between two frames. The loop
/// neither waits nor frees memory: what it has left is freed by the thread that hands in the next
/// one. Other threads may use the newest one at any time.
template <class Thing>
class Handover {
public:
    explicit Handover(std::unique_ptr<Thing> first)
        : running_(new Node{std::move(first), nullptr}), newest_(running_->thing.get()) {}
    ~Handover() {
        delete next_.load();
        delete running_;
        free_chain(left_.load());
        for (Node* node : to_free_)
            delete node;
    }
    Handover(const Handover&) = delete;
    Handover& operator=(const Handover&) = delete;

    /// What the loop runs with.                                                         [loop]
    Thing& running() const noexcept { return *running_->thing; }
    /// If another one was handed in: calls take_over(the new one, the old one), without an
    /// exception, and the loop runs with the new one.                                   [loop]
    template <class TakeOver>
    void advance(const TakeOver& take_over) noexcept {
        if (next_.load(std::memory_order_relaxed) == nullptr) return;
        Node* const next = next_.exchange(nullptr);
        if (next == nullptr) return;
        take_over(*next->thing, *running_->thing);
        // The chain of those that are left: only the loop adds to it, others only take all of it.
        running_->below = left_.exchange(nullptr);
        left_.store(running_);
        running_ = next;
    }

    /// The loop takes it over at its next advance(); one that still waits for that is dropped. Not
    /// from the loop's own frame.                                                       [setup]
    void hand_in(std::unique_ptr<Thing> thing) {
        const std::lock_guard lock(handing_in_);
        auto node = std::make_unique<Node>(std::move(thing), nullptr);
        for (Node* left = left_.exchange(nullptr); left != nullptr; left = left->below)
            to_free_.push_back(left);
        to_free_.reserve(to_free_.size() + 1);
        newest_.store(node->thing.get());
        if (Node* const dropped = next_.exchange(node.release())) to_free_.push_back(dropped);
        // Who asks from now on gets the newest. Who asked before may still be in an older one.
        if (readers_.load() != 0) return;
        for (Node* left : to_free_)
            delete left;
        to_free_.clear();
    }
    /// Calls use(the newest one): that which runs, or will from the next frame on.        [any]
    template <class Use>
    auto with_newest(const Use& use) const noexcept {
        readers_.fetch_add(1);
        auto result = use(*newest_.load());
        readers_.fetch_sub(1);
        return result;
    }

private:
    struct Node {
        std::unique_ptr<Thing> thing;
        Node* below;
        Node(std::unique_ptr<Thing> of, Node* under) : thing(std::move(of)), below(under) {}
    };
    static void free_chain(Node* node) {
        while (node != nullptr)
            delete std::exchange(node, node->below);
    }

    Node* running_; // the loop's
    std::atomic<Node*> next_{nullptr};
    std::atomic<Node*> left_{nullptr}; // a chain
    std::atomic<Thing*> newest_;
    mutable std::atomic<int> readers_{0}; // in with_newest()
    std::mutex handing_in_;
    std::vector<Node*> to_free_; // of hand_in()
};

} // namespace palpate::internal
