// NavFn's A* as Nav2 runs it, as a peer in the same run: cost conversion, set-up of the arrays and propagation from the
// goal until the start is reached. Written after the algorithm of Brock & Khatib (1999) and the constants and the order of
// work of nav2_navfn_planner. The path is not traced, so that its time is a lower bound.
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace {

const int NEUTRAL = 50, OBSTACLE = 254, LETHAL = 253;  // costs: free space, obstacle, the costmap's lowest of an obstacle
const double FACTOR = 0.8;                             // of the costmap's costs
const float HIGH = 1e10f, DIAGONAL = 0.707106781f;
const int BUFFER = 10000;  // entries of a priority buffer

struct Queue {
    std::vector<int> cells = std::vector<int>(BUFFER);
    int size = 0;
};

struct Planner {
    int width, height;
    std::vector<uint8_t> cost;
    std::vector<float> potential, gradient_x, gradient_y;
    std::vector<uint8_t> pending;
    Queue queues[3];

    Planner(int w, int h)
        : width(w), height(h), cost(w * h), potential(w * h), gradient_x(w * h), gradient_y(w * h), pending(w * h) {}

    void set_up(const uint8_t *costmap) {
        for (int n = 0; n < width * height; ++n) {
            const int converted = costmap[n] < LETHAL ? static_cast<int>(NEUTRAL + FACTOR * costmap[n]) : OBSTACLE;
            cost[n] = static_cast<uint8_t>(costmap[n] < LETHAL && converted >= OBSTACLE ? OBSTACLE - 1 : converted);
            potential[n] = HIGH;
            gradient_x[n] = gradient_y[n] = 0.0f;
            pending[n] = 0;
        }
        for (int x = 0; x < width; ++x) cost[x] = cost[(height - 1) * width + x] = OBSTACLE;
        for (int y = 0; y < height; ++y) cost[y * width] = cost[y * width + width - 1] = OBSTACLE;
        for (Queue &queue : queues) queue.size = 0;
    }

    void push(int n, Queue *queue) {
        if (pending[n] || cost[n] >= OBSTACLE || queue->size >= BUFFER) return;
        queue->cells[queue->size++] = n;
        pending[n] = 1;
    }

    // The potential of a planar wave: a parabola through the lowest neighbours in row and column.
    float interpolated(float row, float column, float own) const {
        const float low = row < column ? row : column, difference = row < column ? column - row : row - column;
        if (difference >= own) return low + own;
        const float d = difference / own;
        return low + own * (-0.2301f * d * d + 0.5307f * d + 0.7040f);
    }

    // Updates a cell; where it improves, its neighbours follow in this level or, beyond its threshold, in the next.
    void update(int n, int start_x, int start_y, float threshold, Queue *level, Queue *next) {
        const float left = potential[n - 1], right = potential[n + 1];
        const float up = potential[n - width], down = potential[n + width];
        const float value = interpolated(left < right ? left : right, up < down ? up : down, cost[n]);
        if (value >= potential[n]) return;
        potential[n] = value;
        const float away = static_cast<float>(std::hypot(n % width - start_x, n / width - start_y));
        const float total = value + away * NEUTRAL;
        Queue *queue = total < threshold ? level : next;
        if (left > total + DIAGONAL * cost[n - 1]) push(n - 1, queue);
        if (right > total + DIAGONAL * cost[n + 1]) push(n + 1, queue);
        if (up > total + DIAGONAL * cost[n - width]) push(n - width, queue);
        if (down > total + DIAGONAL * cost[n + width]) push(n + width, queue);
    }

    float run(const uint8_t *costmap, int start_x, int start_y, int goal_x, int goal_y) {
        set_up(costmap);
        const int source = goal_y * width + goal_x, target = start_y * width + start_x;
        Queue *now = &queues[0], *level = &queues[1], *next = &queues[2];
        potential[source] = 0.0f;
        for (int n : {source + 1, source - 1, source - width, source + width}) push(n, now);
        float threshold = static_cast<float>(std::hypot(goal_x - start_x, goal_y - start_y) * NEUTRAL + OBSTACLE);
        while (now->size > 0 && potential[target] >= HIGH) {
            for (int i = 0; i < now->size; ++i) pending[now->cells[i]] = 0;
            for (int i = 0; i < now->size; ++i) update(now->cells[i], start_x, start_y, threshold, level, next);
            now->size = 0;
            std::swap(now, level);
            if (now->size == 0) {
                threshold += 2 * NEUTRAL;
                std::swap(now, next);
            }
        }
        return potential[target];
    }
};

}  // namespace

extern "C" {

void *navfn_create(int width, int height) { return new Planner(width, height); }
void navfn_destroy(void *planner) { delete static_cast<Planner *>(planner); }
float navfn_a_star(void *planner, const uint8_t *costmap, int start_x, int start_y, int goal_x, int goal_y) {
    return static_cast<Planner *>(planner)->run(costmap, start_x, start_y, goal_x, goal_y);
}
}
