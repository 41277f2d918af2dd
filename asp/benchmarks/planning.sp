% Three robots have to bring three boxes, in ten steps at most and with as few actions as can be. Doors are
% open unless something is the matter with them. docs/bench.md compares solving this with
% planning.lp.

#const n = 10.

sorts
#room = {kitchen, office, lab, library, hall}.
#box = [box][1..8].
#robot = {rob1, rob2, rob3}.
#thing = #box + #robot.
#step = 0..n.
#door = door(#room(X), #room(Y)) : X < Y.
#fluent = loc(#thing, #room) + in_hand(#robot, #box).
#action = go(#robot, #room) + grasp(#robot, #box) + putdown(#robot, #box).
#default = opens(#door).

predicates
holds(#fluent, #step).
occurs(#action, #step).
goal(#step).
success().
held(#box, #step).
busy(#step).
next_to(#room, #room).
door_of(#door, #room, #room).
open(#door).
ab(#default).
jammed(#room).

rules
% What actions do, and when they are impossible.
holds(loc(R, L), I + 1) :- occurs(go(R, L), I).
holds(in_hand(R, B), I + 1) :- occurs(grasp(R, B), I).
-holds(in_hand(R, B), I + 1) :- occurs(putdown(R, B), I).
:- occurs(go(R, L), I), holds(loc(R, M), I), not next_to(M, L).
:- occurs(go(R, L), I), holds(loc(R, M), I), door_of(D, M, L), not open(D).
:- occurs(grasp(R, B), I), holds(in_hand(R, C), I).
:- occurs(grasp(R, B), I), held(B, I).
:- occurs(grasp(R, B), I), holds(loc(R, L), I), not holds(loc(B, L), I).
:- occurs(putdown(R, B), I), not holds(in_hand(R, B), I).

% Constraints of states, inertia.
holds(loc(B, L), I) :- holds(loc(R, L), I), holds(in_hand(R, B), I).
-holds(loc(T, L), I) :- holds(loc(T, M), I), L != M.
holds(F, I + 1) :- holds(F, I), not -holds(F, I + 1).

% Doors.
door_of(door(L, M), L, M) :- next_to(L, M).
door_of(door(L, M), M, L) :- next_to(M, L).
next_to(L, M) :- next_to(M, L).
next_to(hall, L) :- L != hall.
next_to(kitchen, office).
open(D) :- not ab(opens(D)), door_of(D, L, M).
-open(D) :- ab(opens(D)).
:- jammed(L), #count{M : door_of(D, L, M), open(D)} > 1.
exception : ab(opens(D)) :+ door_of(D, L, M).
jammed(office).

% Plans.
success :- goal(I).
:- not success.
goal(I) :- holds(loc(box1, lab), I), holds(loc(box2, office), I), holds(loc(box3, hall), I),
    not held(box1, I), not held(box2, I), not held(box3, I).
held(B, I) :- holds(in_hand(R, B), I).
occurs(A, I) | -occurs(A, I) :- not goal(I), I < n.
:- occurs(A, I), occurs(B, I), A != B.
busy(I) :- occurs(A, I).
:- busy(I), I > 0, not busy(I - 1).
#minimize{1, I : busy(I)}.

holds(loc(rob1, hall), 0). holds(loc(rob2, kitchen), 0). holds(loc(rob3, library), 0).
holds(loc(box1, hall), 0). holds(loc(box2, library), 0). holds(loc(box3, kitchen), 0).
holds(loc(box4, office), 0). holds(loc(box5, lab), 0). holds(loc(box6, kitchen), 0).
holds(loc(box7, library), 0). holds(loc(box8, hall), 0).

display
occurs(A, I). ab.
