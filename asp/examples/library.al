% A robot brings books in a university building. Nothing here is about blocks.
%
%   scenesense solve asp/examples/library.al asp/examples/library_day.al --models 0

sort thing.
sort book < thing.
sort textbook < book = {logic_textbook, optics_textbook}.
sort novel < book = {night_train}.
sort robot = {porter}.
sort place = {library, office, kitchen}.
sort door = {glass_door, kitchen_door}.
sort charge = 0..3.

static door_between(door, place, place).
door_between(glass_door, library, office).
door_between(kitchen_door, office, kitchen).

% A door leads both ways.
door_between(D, Q, P) if door_between(D, P, Q).

inertial fluent at(robot, place), lies_in(book, place), carries(robot, book).
inertial fluent open(door), battery(robot, charge).
defined fluent way(place, place), stuck(robot).
estimated fluent quiet(place).

action go(robot, place), take(robot, book), leave(robot, book).
exogenous action slam(door), borrow(book).


% --- What is where.

elsewhere "A book lies in one place only.":
    -lies_in(B, P) if lies_in(B, Q), P != Q.
one_place "The robot is in one place only.":
    -at(R, P) if at(R, Q), P != Q.
one_charge "A battery has one charge.":
    -battery(R, N) if battery(R, M), N != M.

way(P, Q) if door_between(D, P, Q), open(D).
stuck(R) if at(R, P), not way(P, _).


% --- What is usual.

textbooks "Textbooks are in the library.":
    initially normally lies_in(B, library) if textbook(B).
quiet_library "The library is quiet.":
    normally quiet(library).
noisy_kitchen "Places with a way to the kitchen are not quiet.":
    normally -quiet(P) if way(P, kitchen).
no_readers "Where there is no book nobody reads, and it is not quiet.":
    normally -quiet(P) if not lies_in(_, P).


% --- What the robot can do.

going "Who goes to a place arrives, unless the door slams.":
    go(R, P) causes at(R, P) if at(R, Q), door_between(D, Q, P), not slam(D).
draining "Going costs charge.":
    go(R, P) causes battery(R, N - 1) if battery(R, N).
taking "What is taken is carried, and lies nowhere.":
    take(R, B) causes carries(R, B), -lies_in(B, P).
leaving "What is left lies where the robot is.":
    leave(R, B) causes lies_in(B, P), -carries(R, B) if at(R, P).

closed "There is no way through a closed door.":
    impossible go(R, Q) if at(R, P), not way(P, Q).
empty "An empty battery leads nowhere.":
    impossible go(R, P) if battery(R, 0).
not_here "A book must be known to be where the robot is.":
    impossible take(R, B) if at(R, P), not lies_in(B, P).
full "The robot carries one book.":
    impossible take(R, B) if carries(R, C).
not_carried "What is not carried cannot be left.":
    impossible leave(R, B) if not carries(R, B).
one_thing "The robot does one thing at a time.":
    impossible take(R, B), leave(R, C).


% --- What can happen without it.

slam(D) causes -open(D).
borrow(B) causes -lies_in(B, P).
impossible slam(D) if not open(D).

goal tidy "All books are in the library, and the robot is not stuck.":
    all lies_in(B, library), no stuck(R).
